#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "shm/base/names.hpp"
#include "shm/base/seqlock.hpp"
#include "shm/files/memory_file.hpp"

namespace plchost {

/// The supervisor's report of an instance. The numbers are part of the DDS API.
enum class InstanceState : std::uint32_t {
  offline = 0,    ///< no process: not started yet, or ended for good
  starting = 1,   ///< the process sets itself up
  running = 2,    ///< the application runs
  stopped = 3,    ///< the process is up, the application is loaded and stopped
  stopping = 4,   ///< on its way to stopped or offline
  waiting = 5,    ///< ended; will be started again after the back-off, or when its predecessors are up
  safe_mode = 6,  ///< up without its application, after repeated crashes; load or reset to go on
  failed = 7,     ///< could not be set up, or ended and is not restarted by policy
  exception = 8,  ///< the process is up, the application was stopped by a fault; reset to go on
};
[[nodiscard]] std::string_view to_string(InstanceState state) noexcept;

/// When an instance that ended is started again. The numbers are part of the DDS API.
enum class RestartPolicy : std::uint32_t {
  never = 0,
  on_failure = 1,  ///< ended by a signal or with an exit code other than 0, but not because of its set-up
  always = 2,
};
/// As configurations and users write them.
inline constexpr std::array<std::string_view, 3> kRestartPolicyNames = {"never", "on-failure", "always"};

/// The manager's own part of its page.
struct HostStatus {
  FixedText<kMaxHostName> name;
  FixedText<31> version;
  std::int32_t manager_pid = 0;
  std::uint32_t instance_count = 0;
  std::int64_t started_unix_ns = 0;         ///< CLOCK_REALTIME when the manager started
  FixedText<kMaxSchedulerList> schedulers;  ///< that its instances can have, with commas between
};

inline constexpr std::uint32_t kMaxInstances = 64;
/// The names of all instances, with commas between.
inline constexpr std::size_t kMaxAfter = kMaxInstances * (kMaxInstanceName + 1) - 1;

/// How the manager starts and restarts an instance: its part of the configuration, which may change while
/// the manager runs.
struct InstancePlan {
  RestartPolicy restart = RestartPolicy::on_failure;
  std::uint32_t crash_limit = 0;  ///< this many crashes within crash_window_ns: safe mode
  std::int64_t crash_window_ns = 0;
  std::int64_t restart_delay_ns = 0;  ///< doubles with each failure in a row
  std::int64_t restart_delay_max_ns = 0;
  std::uint32_t autostart = 0;
  std::uint32_t share_core = 0;
  FixedText<15> priority_band;
  FixedText<kMaxPath> settings;     ///< path; empty: the runtime's defaults
  FixedText<kMaxPath> application;  ///< path; empty: none. The loaded one may be another one
  FixedText<kMaxAfter> after;       ///< names of the instances that it waits for, with commas between
};

/// An instance as its manager sees it.
struct InstanceStatus {
  FixedText<kMaxInstanceName> name;
  FixedText<kMaxSchedulerName> scheduler;
  FixedText<kMaxPath> application;  ///< path; empty if none
  FixedText<kMaxPath> problem;      ///< why it is not running, or how it ended last; empty if all is well
  InstanceState state = InstanceState::offline;
  std::int32_t pid = 0;
  std::int32_t core = -1;  ///< the core the kernel granted; -1 while there is no process
  std::uint32_t restarts = 0;
  std::int64_t state_since_unix_ns = 0;
  std::uint32_t removed = 0;  ///< 1: it is no longer in the configuration, and there until it is stopped
  std::uint32_t reserved = 0;
  InstancePlan plan;
};

/// The manager's knowledge, for others to read. One writer: the manager's Reactor thread.
struct HostPageLayout {
  std::uint64_t magic = 0;  ///< written last
  std::uint32_t version = 0;
  std::uint32_t size = 0;
  std::atomic<std::uint64_t> changes{0};  ///< grows with every write: readers look at this first
  Seqlock<HostStatus> host;
  std::array<Seqlock<InstanceStatus>, kMaxInstances> instances;
};

[[nodiscard]] std::string host_page_name(std::string_view pool);

/// The manager's end.
class HostPageWriter {
 public:
  /// Goes on with the page of an earlier manager if there is one, so that readers need not open it anew.
  [[nodiscard]] static Result<HostPageWriter> create(std::string_view pool);
  static void remove(std::string_view pool) noexcept;
  /// Readers find all places below its instance_count written, an unused one without name.
  void write_host(const HostStatus& status) noexcept;
  /// `index` < kMaxInstances; read once the instance_count written with the host is greater. A status
  /// without name: there is no instance at this place.
  void write_instance(std::uint32_t index, const InstanceStatus& status) noexcept;
  /// Writes again what is not as it was written last: by a stranger. A page that was cut short is made anew.
  /// Whether there was such a thing.
  bool keep();

 private:
  HostPageWriter(std::string name, MemoryFile memory)
      : name_(std::move(name)), memory_(std::move(memory)), instances_(kMaxInstances) {}
  std::string name_;
  MemoryFile memory_;
  HostStatus host_;  // as written last, here and below
  std::vector<InstanceStatus> instances_;
};

/// A reader's end, in any process. A part that it cannot read at the moment is still there: readers that show
/// all that there is use HostPageCopy.
class HostPageReader {
 public:
  /// not_found: no manager has made it yet. corrupt: not such a page.
  [[nodiscard]] static Result<HostPageReader> open(std::string_view pool);
  [[nodiscard]] std::uint64_t changes() const noexcept;
  /// It was cut short, and tells nothing since: open it anew.
  [[nodiscard]] bool lost() const noexcept { return memory_.lost(); }
  /// Nothing if the writer was in the way (try again later), the page was cut short, or nothing valid was
  /// written yet. Names and texts are what they may be, without control characters.
  [[nodiscard]] std::optional<HostStatus> host() const noexcept;
  [[nodiscard]] std::optional<InstanceStatus> instance(std::uint32_t index) const noexcept;
  /// Numbers of the writes to a part, so that it need not be copied again: the same even number as before a
  /// copy means that the copy holds. Odd: the part is being written.
  [[nodiscard]] std::uint64_t host_sequence() const noexcept;
  [[nodiscard]] std::uint64_t instance_sequence(std::uint32_t index) const noexcept;

 private:
  explicit HostPageReader(MemoryFile memory) noexcept : memory_(std::move(memory)) {}
  MemoryFile memory_;
};

}  // namespace plchost
