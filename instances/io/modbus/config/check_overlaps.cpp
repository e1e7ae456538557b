#include "instances/io/modbus/config/check_overlaps.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>

#include <fmt/format.h>

#include "instances/io/modbus/config/endpoint.hpp"
#include "instances/io/modbus/config/modbus_keys.hpp"
#include "shm/base/names.hpp"

namespace plchost::modbus {

namespace {

/// A run of bits or registers that nothing else may have.
struct Claim {
  std::uint64_t begin;
  std::uint64_t end;
  unsigned line;
  std::string_view key;  ///< says where it begins
};

class Claims {
 public:
  void add(std::string space, std::string_view key, std::uint64_t begin, std::uint64_t size, unsigned line) {
    claims_[std::move(space)].push_back({.begin = begin, .end = begin + size, .line = line, .key = key});
  }
  /// `what`: of the problem, behind the lines.
  void check(std::vector<ConfigProblem>& problems, std::string_view what) {
    for (auto& [space, claims] : claims_) {
      std::ranges::sort(claims, {}, [](const Claim& claim) { return std::tie(claim.begin, claim.end); });
      const Claim* furthest = nullptr;
      for (const Claim& claim : claims) {
        if (furthest != nullptr && claim.begin < furthest->end)
          report(problems, *furthest, claim, space, what);
        if (furthest == nullptr || claim.end > furthest->end) furthest = &claim;
      }
    }
  }

 private:
  static void report(std::vector<ConfigProblem>& problems, const Claim& one, const Claim& other,
                     const std::string& space, std::string_view what) {
    const auto& [first, second] =
        std::minmax(one, other, [](const Claim& a, const Claim& b) { return a.line < b.line; });
    problems.push_back(
        {.line = second.line,
         .text = fmt::format("{}: overlaps with line {}: both have {} {} {} to {}; give each "
                             "its own",
                             second.key, first.line, space, what, std::max(one.begin, other.begin),
                             std::min(one.end, other.end) - 1)});
  }

  std::map<std::string, std::vector<Claim>> claims_;
};

std::string kind_name(const RegisterMap& map) {
  return std::string(kKindNames[std::to_underlying(map.kind)]);
}

template <class Entry>
void check_names(const std::vector<Entry>& entries, std::string_view section,
                 std::vector<ConfigProblem>& problems) {
  std::map<std::string_view, unsigned> lines;
  for (const Entry& entry : entries) {
    if (entry.name.empty()) continue;  // reported where it was read
    const auto [known, added] = lines.emplace(entry.name, entry.line);
    if (added) continue;
    problems.push_back({.line = entry.line,
                        .text = fmt::format("{} '{}' name: is taken already in line {}", section,
                                            shown(entry.name), known->second)});
  }
}

void check_places(const ModbusConfig& config, std::vector<ConfigProblem>& problems) {
  Claims images;
  constexpr std::uint64_t kStatusBits = sizeof(DeviceStatus) * 8;
  const auto fill = [&](const RegisterMap& map) {
    images.add(fmt::format("image '{}'", shown(map.image)), "offset", first_bit(map), size_in_bits(map),
               map.line);
  };
  for (const DeviceConfig& device : config.devices) {
    for (const RegisterMap& map : device.reads) fill(map);
    if (device.status_image.empty()) continue;
    images.add(fmt::format("image '{}'", shown(device.status_image)), "status_offset",
               std::uint64_t{device.status_offset} * 8, kStatusBits, device.line);
  }
  if (config.server) {
    for (const RegisterMap& map : config.server->maps) {
      if (map.writable) fill(map);
    }
  }
  images.check(problems, "bits");
}

void check_registers(const ModbusConfig& config, std::vector<ConfigProblem>& problems) {
  Claims written;
  for (const DeviceConfig& device : config.devices) {
    for (const RegisterMap& map : device.writes) {
      written.add(fmt::format("{} of device '{}'", kind_name(map), shown(device.name)), "address",
                  map.address, map.count, map.line);
    }
  }
  written.check(problems, "addresses");
  if (!config.server) return;
  Claims served;
  for (const RegisterMap& map : config.server->maps)
    served.add(kind_name(map), "address", map.address, map.count, map.line);
  served.check(problems, "addresses");
}

// One text for each address, however it is written.
std::string address_of(const DeviceConfig& device) {
  const auto endpoint = parse_endpoint(device.tcp);
  return device.tcp.empty() || !endpoint ? device.serial + device.tcp : endpoint->text();
}

void check_device_addresses(const std::vector<DeviceConfig>& devices, std::vector<ConfigProblem>& problems) {
  std::map<std::pair<std::string, int>, unsigned> units;
  std::map<std::string_view, const DeviceConfig*> serial_lines;
  for (const DeviceConfig& device : devices) {
    const std::string_view place = device.tcp.empty() ? device.serial : device.tcp;
    if (place.empty()) continue;  // reported where it was read
    const auto [known, added] = units.emplace(std::pair{address_of(device), int{device.unit}}, device.line);
    if (!added) {
      problems.push_back(
          {.line = device.line,
           .text = fmt::format(
               "[[device]] '{}' unit: {} unit {} is the device of line {}; give all maps to one of "
               "both",
               shown(device.name), shown(place), int{device.unit}, known->second)});
    }
    if (device.serial.empty()) continue;
    const DeviceConfig& first = *serial_lines.emplace(device.serial, &device).first->second;
    if (std::tie(first.baud, first.parity, first.stop_bits) ==
        std::tie(device.baud, device.parity, device.stop_bits)) {
      continue;
    }
    problems.push_back(
        {.line = device.line,
         .text = fmt::format("[[device]] '{}' baud: {} has another baud, parity or stop_bits in "
                             "line {}; all devices of one line have the same",
                             shown(device.name), shown(device.serial), first.line)});
  }
}

}  // namespace

void check_overlaps(const ModbusConfig& config, std::vector<ConfigProblem>& problems) {
  check_names(config.images, "[[image]]", problems);
  check_names(config.devices, "[[device]]", problems);
  check_device_addresses(config.devices, problems);
  check_places(config, problems);
  check_registers(config, problems);
}

}  // namespace plchost::modbus
