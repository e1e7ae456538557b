#pragma once

#include <expected>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "manager/config/manager_config.hpp"
#include "shm/base/result.hpp"

namespace plchost {

/// The surroundings that a configuration is checked against: this host, or those of a test.
struct ConfigSurroundings {
  std::string host_name;            ///< the default of [host] name
  std::vector<int> online_cores;    ///< of the system
  std::vector<int> isolated_cores;  ///< by the kernel; may be empty
  std::vector<std::string_view> schedulers;
  bool check_files = true;  ///< that settings and applications are there and readable
  /// For --check-config only: faults that a start finds later, because they concern one instance or may still
  /// change.
  bool check_directories = false;            ///< that they are there or can be made
  std::vector<std::string> interfaces = {};  ///< of the system; empty: not checked
  /// Owner and mode of the state directory and its folders. Null: not checked.
  std::function<Result<void>(const HostConfig& host)> check_state = {};
  /// Of an instance that has one. Null: not checked.
  std::function<Result<void>(const HostConfig& host, const InstanceConfig& instance)> check_application = {};
  std::function<Result<void>(const std::string& file)> check_settings = {};  ///< null: not checked
};

/// All that is wrong, one line of text each: "FILE:LINE: [[instance]] 'line1' core: ...".
using ConfigErrors = std::vector<std::string>;

/// Parses and validates as a whole. `file` is for messages and for the folder that relative paths start in.
[[nodiscard]] std::expected<ManagerConfig, ConfigErrors> parse_config(std::string_view text,
                                                                      const std::string& file,
                                                                      const ConfigSurroundings& surroundings);
[[nodiscard]] std::expected<ManagerConfig, ConfigErrors> load_config(const std::string& file,
                                                                     const ConfigSurroundings& surroundings);

/// The path as an absolute one, seen from `folder`.
[[nodiscard]] std::string resolve_path(const std::string& folder, const std::string& path);

}  // namespace plchost
