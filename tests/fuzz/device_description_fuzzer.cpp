#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include "instances/runtime/settings/device_description.hpp"
#include "shm/base/names.hpp"

// Any bytes are refused with an error that begins with the file's name, or give events whose names can be.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace plchost;
  const auto device = parse_device_description({reinterpret_cast<const char*>(data), size}, "d.xml");
  if (!device) {
    if (!device.error().message.starts_with("d.xml:")) std::abort();
    return 0;
  }
  if (device->events.size() > kMaxDeviceEvents || (!device->supports_external && !device->events.empty()))
    std::abort();
  const auto good = [](const std::string& name) {
    return check_name("name", name, kMaxEventName).has_value();
  };
  if (!std::ranges::all_of(device->events, good)) std::abort();
  return 0;
}
