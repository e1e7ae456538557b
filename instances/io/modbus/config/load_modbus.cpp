#include "instances/io/modbus/config/load_modbus.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <utility>
#include <variant>

#include <fmt/format.h>

#include "instances/io/modbus/config/check_map.hpp"
#include "instances/io/modbus/config/check_overlaps.hpp"
#include "instances/io/modbus/config/endpoint.hpp"
#include "instances/io/modbus/config/modbus_keys.hpp"
#include "shm/base/names.hpp"
#include "shm/toml/section_reader.hpp"
#include "shm/toml/text_file.hpp"
#include "shm/toml/toml_document.hpp"

namespace plchost::modbus {

namespace {

constexpr std::size_t kMostProblems = 100;  // more are not told
constexpr std::array kSections = {"modbus"sv, "image"sv, "device"sv, "server"sv};
constexpr std::array kOnlySerial = {"baud"sv, "parity"sv, "stop_bits"sv, "probe"sv};
constexpr std::uint8_t kLastSerialUnit = 247;
constexpr std::uint8_t kUnitOfTcp = 255;  // of a device that is no gateway

class Loader {
 public:
  std::expected<ModbusConfig, std::vector<ConfigProblem>> load(std::string_view text) {
    if (const auto root = parse_toml(text)) {
      read_root(*root);
      check_overlaps(config_, problems_);
    } else {
      problems_.push_back(root.error());
    }
    if (problems_.empty()) return std::move(config_);
    std::ranges::stable_sort(problems_, {}, &ConfigProblem::line);
    if (problems_.size() > kMostProblems) problems_.resize(kMostProblems);
    return std::unexpected(std::move(problems_));
  }

 private:
  using ReadTable = std::function<void(const TomlTable& table, unsigned line, std::size_t index)>;

  void problem(const TomlValue& value, std::string text) {
    problems_.push_back({.line = value.line, .text = std::move(text), .column = value.column});
  }
  SectionReader reader_of(const TomlTable& table, unsigned line, std::string where) {
    SectionReader reader(table, line, std::move(where), problems_);
    reader.tell_columns();
    return reader;
  }

  void read_root(const TomlTable& root) {
    for (const auto& [key, value] : root) {
      if (std::ranges::find(kSections, std::string_view(key)) != kSections.end()) continue;
      problem(value, fmt::format("unknown section or key '{}'; allowed are [modbus], [[image]], [[device]], "
                                 "[server]{}",
                                 shown(key), suggestion(key, kSections)));
    }
    read_section(root, "modbus", [&](const TomlTable& table, unsigned line, std::size_t) {
      SectionReader reader = reader_of(table, line, "[modbus]");
      read_keys(process_keys(), ModbusReading{}, reader, config_.process);
    });
    read_tables(root, "image", "[[image]]", kMaxImages,
                [&](const TomlTable& table, unsigned line, std::size_t index) {
                  ImageConfig image;
                  image.line = line;
                  SectionReader reader = reader_of(table, line, name_of("[[image]]", table, index));
                  read_keys(image_keys(), ModbusReading{}, reader, image);
                  if (!reader.wrong("direction")) image.direction_line = reader.line_of("direction");
                  if (image.name.empty() && !reader.wrong("name")) reader.problem("name", "is empty");
                  config_.images.push_back(std::move(image));
                });
    read_tables(root, "device", "[[device]]", kMaxDevices,
                [&](const TomlTable& table, unsigned line, std::size_t index) {
                  read_device(table, line, name_of("[[device]]", table, index));
                });
    read_section(root, "server",
                 [&](const TomlTable& table, unsigned line, std::size_t) { read_server(table, line); });
    const bool idle = config_.devices.empty() && !config_.server && problems_.empty();
    if (idle) problems_.push_back({.line = 0, .text = "has nothing to do; add a [[device]] or [server]"});
  }

  static std::string name_of(std::string_view section, const TomlTable& table, std::size_t index) {
    const auto name = table.find("name");
    const auto* text = name == table.end() ? nullptr : std::get_if<std::string>(&name->second.value);
    return text != nullptr ? fmt::format("{} '{}'", section, shown(*text))
                           : fmt::format("{} number {}", section, index + 1);
  }

  void read_section(const TomlTable& root, std::string_view name, const ReadTable& read) {
    const auto found = root.find(name);
    if (found == root.end()) return;
    const auto* const table = std::get_if<TomlTable>(&found->second.value);
    if (table == nullptr) return problem(found->second, fmt::format("'{0}' must be a section: [{0}]", name));
    read(*table, found->second.line, 0);
  }
  /// An array of tables, written as `section` says.
  void read_tables(const TomlTable& parent, std::string_view name, std::string_view section, std::size_t most,
                   const ReadTable& read) {
    const auto found = parent.find(name);
    if (found == parent.end()) return;
    const auto* const array = std::get_if<TomlArray>(&found->second.value);
    if (array == nullptr)
      return problem(found->second, fmt::format("'{}' must be written {}", name, section));
    if (array->size() > most) {
      return problem(found->second, fmt::format("{} {}; allowed are up to {}", array->size(), section, most));
    }
    for (std::size_t i = 0; i < array->size(); ++i) {
      const TomlValue& element = (*array)[i];
      const auto* const table = std::get_if<TomlTable>(&element.value);
      if (table == nullptr) {
        problem(element, fmt::format("'{}' must be written {}", name, section));
      } else {
        read(*table, element.line, i);
      }
    }
  }

  void read_device(const TomlTable& table, unsigned line, const std::string& where) {
    DeviceConfig device;
    device.line = line;
    SectionReader reader = reader_of(table, line, where);
    reader.know("read");
    reader.know("write");
    read_keys(device_keys(), ModbusReading{}, reader, device);
    // One name for each line: devices of one line take turns.
    device.serial = std::filesystem::path(device.serial).lexically_normal().string();
    check_way(reader, device);
    check_device(reader, device, table.contains("read"));
    read_maps(table, "read", where + " [[device.read]]", MapUse::device_read, device.reads);
    read_maps(table, "write", where + " [[device.write]]", MapUse::device_write, device.writes);
    if (!table.contains("read") && !table.contains("write")) {
      reader.problem("name", "the device has no map; add [[device.read]] or [[device.write]]");
    }
    if (!device.serial.empty() && !reader.wrong("timeout_ms") && !reader.wrong("baud"))
      check_time(reader, device);
    config_.devices.push_back(std::move(device));
  }
  // The time limit of a response begins with its request, and ends with its last byte.
  static void check_time(SectionReader& reader, const DeviceConfig& device) {
    constexpr std::int64_t kAround = 5;  // unit, function, number of bytes, checksum
    const std::int64_t character = 9 + device.stop_bits + (device.parity == Parity::none ? 0 : 1);
    for (const RegisterMap& map : device.reads) {
      const std::int64_t bits = (kAround + static_cast<std::int64_t>(size_in_bits(map) + 7) / 8) * character;
      const auto needed =
          std::chrono::ceil<std::chrono::milliseconds>(Duration(std::chrono::seconds(bits)) / device.baud);
      if (needed < device.timeout) continue;
      reader.problem(
          "timeout_ms",
          fmt::format("the response of the map in line {} alone takes {} ms at {} baud; allowed is "
                      "more, or give the map a smaller count",
                      map.line, needed.count(), device.baud));
      return;
    }
  }
  static void check_way(SectionReader& reader, const DeviceConfig& device) {
    if (reader.wrong("tcp") || reader.wrong("serial")) return;
    if (device.tcp.empty() == device.serial.empty()) {
      return reader.problem("tcp", device.tcp.empty() ? "is missing, and so is serial; allowed is one of both"
                                                      : "stands beside serial; allowed is one of both");
    }
    if (device.serial.empty()) {
      for (const std::string_view key : kOnlySerial) {
        if (reader.has(key)) reader.problem(key, "is for serial, and the device has tcp; leave it out");
      }
      if (device.unit > kLastSerialUnit && device.unit != kUnitOfTcp) {
        reader.problem("unit", fmt::format("{} is reserved; allowed is 0 to {}, and {}", int{device.unit},
                                           int{kLastSerialUnit}, int{kUnitOfTcp}));
      }
      return;
    }
    if (reader.has("share_connection")) {
      reader.problem("share_connection", "is for tcp, and the device has serial; leave it out");
    }
    if (device.unit == 0 || device.unit > kLastSerialUnit) {
      reader.problem("unit", fmt::format("{} is no address at a serial line; allowed is 1 to {}",
                                         int{device.unit}, int{kLastSerialUnit}));
    }
  }
  static std::int64_t in_ms(Duration time) {
    return std::chrono::duration_cast<std::chrono::milliseconds>(time).count();
  }
  static std::string_view by_default(const SectionReader& reader, std::string_view key) {
    return reader.has(key) ? "" : " by default";
  }
  static void check_pauses(SectionReader& reader, const DeviceConfig& device) {
    if (reader.wrong("reconnect_ms") || reader.wrong("reconnect_max_ms")) return;
    if (device.reconnect_max >= device.reconnect) return;
    const auto least = in_ms(device.reconnect);
    const auto most = in_ms(device.reconnect_max);
    if (reader.has("reconnect_max_ms")) {
      return reader.problem("reconnect_max_ms",
                            fmt::format("{} is below reconnect_ms, which is {}{}; allowed is that or more",
                                        most, least, by_default(reader, "reconnect_ms")));
    }
    reader.problem("reconnect_ms", fmt::format("{} is above reconnect_max_ms, which is {} by default; set "
                                               "reconnect_max_ms, or a shorter reconnect_ms",
                                               least, most));
  }
  // A default has no meaning if nothing becomes zero.
  static void check_age(SectionReader& reader, const DeviceConfig& device, bool has_reads) {
    if (reader.wrong("poll_ms") || reader.wrong("gone_after_ms") || reader.wrong("when_gone")) return;
    if (device.gone_after > device.poll) return;
    const auto age = in_ms(device.gone_after);
    const auto poll = in_ms(device.poll);
    if (reader.has("gone_after_ms")) {
      return reader.problem(
          "gone_after_ms",
          fmt::format("{} is not above poll_ms, which is {}{}; allowed is more than the time "
                      "of two polls",
                      age, poll, by_default(reader, "poll_ms")));
    }
    if (!has_reads || device.when_gone != LossPolicy::zero) return;
    reader.problem("poll_ms", fmt::format("{} is not below gone_after_ms, which is {} by default; set "
                                          "gone_after_ms to more than the time of two polls",
                                          poll, age));
  }
  void check_device(SectionReader& reader, const DeviceConfig& device, bool has_reads) {
    check_pauses(reader, device);
    check_age(reader, device, has_reads);
    if (device.status_image.empty()) {
      if (reader.has("status_offset")) reader.problem("status_offset", "needs status_image");
      return;
    }
    if (reader.wrong("status_image")) return;
    const ImageConfig* const image = find_image(reader, "status_image", config_.images, device.status_image);
    if (image == nullptr) return;
    if (image->direction_line != 0 && image->direction != ImageDirection::input) {
      reader.problem("status_image", "is no input image; allowed is an image with direction = \"input\"");
    }
    if (image->size != 0 && device.status_offset + sizeof(DeviceStatus) > image->size) {
      reader.problem("status_offset", fmt::format("the status has {} bytes, and image '{}' has {}",
                                                  sizeof(DeviceStatus), shown(image->name), image->size));
    }
  }

  void read_server(const TomlTable& table, unsigned line) {
    ServerConfig& server = config_.server.emplace();
    server.line = line;
    SectionReader reader = reader_of(table, line, "[server]");
    reader.know("map");
    read_keys(server_keys(), ModbusReading{}, reader, server);
    if (!reader.wrong("listen")) {
      const auto endpoint = parse_endpoint(server.listen);
      if (!endpoint) {
        reader.problem("listen", endpoint.error());
      } else if (!endpoint->is_loopback() && !server.allow_unsecured) {
        reader.problem("listen", fmt::format("\"{}\" is no loopback address, and Modbus has no security; set "
                                             "allow_unsecured = true, or listen at 127.0.0.1",
                                             shown(server.listen)));
      }
    }
    read_maps(table, "map", "[[server.map]]", MapUse::server, server.maps);
    if (!table.contains("map")) reader.problem("listen", "the server shows nothing; add [[server.map]]");
  }

  void read_maps(const TomlTable& parent, std::string_view key, const std::string& where, MapUse use,
                 std::vector<RegisterMap>& maps) {
    const std::string section = where.substr(where.rfind("[["));
    read_tables(
        parent, key, section, kMaxMaps, [&](const TomlTable& table, unsigned line, std::size_t index) {
          RegisterMap map;
          map.line = line;
          SectionReader reader = reader_of(table, line, fmt::format("{} number {}", where, index + 1));
          read_rows(map_keys(), ModbusReading{}, reader, map);
          if (use == MapUse::device_read) read_rows(read_map_keys(), ModbusReading{}, reader, map);
          if (use == MapUse::device_write) read_rows(write_map_keys(), ModbusReading{}, reader, map);
          if (use == MapUse::server) read_rows(server_map_keys(), ModbusReading{}, reader, map);
          reader.refuse_unknown_keys();
          check_map(reader, config_.images, map, use);
          maps.push_back(std::move(map));
        });
  }

  ModbusConfig config_;
  std::vector<ConfigProblem> problems_;
};

}  // namespace

std::expected<ModbusConfig, ConfigErrors> parse_modbus_config(std::string_view text,
                                                              const std::string& file) {
  auto config = Loader().load(text);
  if (config) return std::move(*config);
  ConfigErrors errors;
  for (const ConfigProblem& problem : config.error()) {
    errors.push_back(
        describe(file, {.line = problem.line, .text = printable(problem.text), .column = problem.column}));
  }
  return std::unexpected(std::move(errors));
}

std::expected<ModbusConfig, ConfigErrors> load_modbus_config(const std::string& file) {
  const auto text = read_config_text(file, kMaxConfigBytes);
  if (!text) return std::unexpected(ConfigErrors{fmt::format("{}: {}", file, text.error().describe())});
  return parse_modbus_config(*text, file);
}

}  // namespace plchost::modbus
