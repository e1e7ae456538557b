#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <sys/types.h>

#include "shm/base/time.hpp"
#include "shm/block_driver/node_directory.hpp"
#include "shm/pages/host_page.hpp"

namespace plchost {

/// Which processes the kernel ends first when the host has no memory left: those with the highest
/// oom_score_adj. Others have 0. The end of an instance stops a machine, that of the manager stops none.
inline constexpr int kInstanceOomScore = -950;
inline constexpr int kManagerOomScore = -900;

/// [host]: the controller as a whole.
struct HostConfig {
  std::string name;                 ///< default: the system's host name
  std::vector<std::string> labels;  ///< by which clients choose hosts
  int dds_domain = 0;
  std::string run_directory = "/run/plchost";
  std::string state_directory = "/var/lib/plchost";  ///< of the data that outlive a power cut
  std::uint32_t application_limit_mib = 64;          ///< of a file that is sent
  std::uint32_t application_versions = 5;            ///< of those that are kept, for each instance
  std::string pool = "plchost";
  std::uint32_t pool_objects = 4096;
  bool pool_across_containers = false;  ///< its users may be in several PID namespaces
  std::string pool_owner;               ///< user's name or number; empty: the user that starts the manager
  std::string pool_group;   ///< group's name or number; empty: that of the user that starts the manager
  mode_t pool_mode = 0660;  ///< permission bits of the pool and, where nothing else is said, of its memories
  std::string
      instance_user;  ///< name or number of the user that instances run as; empty: that of the manager
  std::string instance_groups;  ///< folder of their control groups; empty: that of plchost-instances.service
  std::vector<int> cores;       ///< where instances may run
  std::vector<int> housekeeping_cores;       ///< where the manager and the API server run
  std::string read_variables = "engineer";   ///< the role that may, of a secured host
  std::string write_variables = "engineer";  ///< the same, also to force
  std::string log_level = "info";
  bool allow_debug = true;  ///< instances may load applications that are debug builds
  bool keep_pool = false;   ///< leave the pool in place at the end, for firmware that has it mapped
};

/// [dds]: how the API server is reached.
struct DdsConfig {
  bool enabled = true;  ///< false: no API server
  std::string interface = "lo";
  std::vector<std::string> peers;  ///< addresses asked for other hosts where there is no multicast
  bool multicast = true;           ///< look for others by multicast, too; never on lo
  std::string identity;            ///< folder of the host's identity; empty: no security
  std::string user;                ///< of the API server; empty: that of the manager
  bool allow_unsecured = false;    ///< without an identity: on another interface than lo all the same

  bool operator==(const DdsConfig&) const = default;
};

/// [blocks]: blocks between instances, and to those of other hosts.
struct BlocksConfig {
  std::uint16_t host_number = 0;  ///< how other hosts call this one; 0: no blocks to and from other hosts
  std::string base = std::string(kDefaultBlockBase);  ///< of the nodes that other hosts reach
};

/// One [[instance]]. Paths are absolute here, whatever the file said.
struct InstanceConfig {
  std::string name;
  int core = -1;
  bool share_core = false;
  std::string scheduler;  ///< empty: as the settings say, else CmpSchedule
  std::string priority_band = "normal";
  std::uint32_t memory_max_mib = 0;   ///< of all its processes; 0: no limit
  std::uint32_t pids_max = 0;         ///< threads and processes; 0: no limit
  int oom_score = kInstanceOomScore;  ///< oom_score_adj
  std::string settings;               ///< empty: the runtime's defaults
  std::string application;            ///< empty: comes up without one
  bool autostart = true;
  std::vector<std::string> after;  ///< started only when these are up
  RestartPolicy restart = RestartPolicy::on_failure;
  Duration restart_delay = std::chrono::milliseconds(100);  ///< doubles with each failure in a row
  Duration restart_delay_max = std::chrono::seconds(5);
  std::uint32_t crash_limit = 5;  ///< this many crashes within crash_window: safe mode
  Duration crash_window = std::chrono::seconds(60);
};

struct ManagerConfig {
  HostConfig host;
  DdsConfig dds;
  BlocksConfig blocks;
  std::vector<InstanceConfig> instances;
};

/// Bounds of what a file may say.
inline constexpr std::size_t kMaxLabels = 4;  // the room in an entry of a sample
inline constexpr std::size_t kMaxLabel = 30;
inline constexpr std::size_t kMaxConfigBytes = std::size_t{1} << 20;
inline constexpr std::int64_t kMinPoolObjects = 16;
inline constexpr std::int64_t kMaxPoolObjects = 1'000'000;
inline constexpr std::size_t kMaxPoolName = 31;
/// So that "RUN_DIRECTORY/NAME.sock" fits in the 107 characters of a socket path.
inline constexpr std::size_t kMaxRunDirectory = 70;
inline constexpr std::int64_t kMaxApplicationVersions = 100;
inline constexpr std::int64_t kMinMemoryMib = 16;
inline constexpr std::int64_t kMaxMemoryMib = 1'048'576;
inline constexpr std::int64_t kMinPids = 16;
inline constexpr std::int64_t kMaxPids = 100'000;
/// The unit allows no lower one.
inline constexpr std::int64_t kMinOomScore = kInstanceOomScore;
inline constexpr std::int64_t kMaxOomScore = 1000;
inline constexpr std::size_t kMaxPeers = 32;
inline constexpr std::int64_t kMaxRestartDelayMs = 3'600'000;
inline constexpr std::int64_t kMaxCrashLimit = 100;
inline constexpr std::int64_t kMaxCrashWindowS = 86'400;

}  // namespace plchost
