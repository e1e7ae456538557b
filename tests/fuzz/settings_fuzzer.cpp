// Any text is either a settings file or refused with its line.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "instances/runtime/settings/read_settings.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto settings = plchost::parse_settings({reinterpret_cast<const char*>(data), size}, "f");
  if (!settings && !settings.error().message.starts_with("f:")) std::abort();
  return 0;
}
