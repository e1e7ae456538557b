// Any bytes are either an application or refused with a reason.
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <string_view>

#include "instances/runtime/application/elf_check.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr std::array<std::string_view, 1> kExports = {"plc_app_init"};
  const auto checked = plchost::check_elf(std::as_bytes(std::span(data, size)), kExports);
  if (!checked && checked.error().message.empty()) std::abort();
  return 0;
}
