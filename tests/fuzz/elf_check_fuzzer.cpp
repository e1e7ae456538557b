// Any bytes are either an application or refused with a reason, also of an online change.
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <string_view>

#include "instances/runtime/application/elf_check.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr std::array<std::string_view, 1> kExports = {"plc_app_init"};
  const auto file = std::as_bytes(std::span(data, size));
  const auto checked = plchost::check_elf(file, kExports);
  const auto can_leave = plchost::check_elf_can_leave(file);
  if (!checked && checked.error().message.empty()) std::abort();
  if (!can_leave && can_leave.error().message.empty()) std::abort();
  return 0;
}
