#pragma once

#include <cstddef>
#include <expected>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace plchost {

/// The wanted state of an instance. Empty, or no value: as it is.
struct WantedInstance {
  std::string name;
  unsigned line = 0;
  std::string scheduler;            ///< its host must have it
  std::string application;          ///< path on the host
  std::optional<bool> running;      ///< false: stopped
  std::vector<std::string> events;  ///< registered; others are left as they are
};

struct WantedHost {
  std::string name;
  unsigned line = 0;
  std::vector<WantedInstance> instances;
};

/// How the hosts of a plant are to be: the file of `plcctl diff` and `plcctl apply`.
struct Plant {
  std::string file;
  std::vector<WantedHost> hosts;
};

/// All that is wrong, each with file and line.
using PlantErrors = std::vector<std::string>;

/// Any text, hostile ones included.
[[nodiscard]] std::expected<Plant, PlantErrors> parse_plant(std::string_view text, const std::string& file);
/// "-": standard input.
[[nodiscard]] std::expected<Plant, PlantErrors> load_plant(const std::string& file);

/// Bounds of what a file may say.
inline constexpr std::size_t kMaxPlantBytes = std::size_t{4} << 20;
inline constexpr std::size_t kMaxPlantHosts = 1024;
inline constexpr std::size_t kMaxHostInstances = 64;
inline constexpr std::size_t kMaxInstanceEvents = 1024;

}  // namespace plchost
