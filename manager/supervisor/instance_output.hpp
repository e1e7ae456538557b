#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "manager/supervisor/output_lines.hpp"
#include "shm/base/unique_fd.hpp"
#include "shm/pages/log_ring.hpp"

namespace plchost {

/// The standard output and error of the processes of one instance. They go into a named pipe in the run
/// directory, which the manager reads into the instance's LogRing and onto its own standard error. No process
/// waits for the manager: a full pipe takes nothing more. While no manager runs, the pipe keeps up to
/// kPipeBytes for the next one, as long as the process of the instance runs. Reactor thread.
class InstanceOutput {
 public:
  struct Settings {
    std::string pool;
    std::string instance;
    std::string run_directory;
  };
  static constexpr int kPipeBytes = 256 * 1024;
  /// Of one read(): an instance that says more than this every 50 ms loses lines.
  static constexpr std::size_t kReadAtOnce = std::size_t{64} * 1024;
  static constexpr std::size_t kLastLine = 500;

  explicit InstanceOutput(Settings settings) : settings_(std::move(settings)) {}

  /// The end that becomes standard output and error of a new process.
  [[nodiscard]] Result<UniqueFd> open_for_process();
  /// Takes over the pipe that an adopted process writes to, if that is there.
  void adopt();
  /// Reads what has come, up to kReadAtOnce. `pid`: of the process.
  void read(std::int32_t pid);
  /// The process has ended: reads all that it has said.
  void end(std::int32_t pid);
  /// The last line of the newest process, of a longer one the last kLastLine bytes; empty: it has said
  /// nothing.
  [[nodiscard]] const std::string& last_line() const noexcept { return last_line_; }
  /// Writes a line of the manager itself into the ring.
  void say(LogLevel level, std::int32_t pid, std::string_view text);

 private:
  [[nodiscard]] std::string path() const {
    return settings_.run_directory + "/" + settings_.instance + ".output";
  }
  [[nodiscard]] Result<void> open_ends();
  [[nodiscard]] std::size_t read_at_most(std::size_t most, std::int32_t pid);
  void take(const LogEntry& entry);
  void keep(const LogEntry& entry);
  void forward(std::string_view bytes);

  Settings settings_;
  UniqueFd read_end_;
  UniqueFd write_end_;  // only to see whether the pipe is full
  OutputLines lines_;
  std::string last_line_;
  std::optional<LogRing> ring_;
  std::uint64_t not_forwarded_ = 0;  // bytes
  bool ring_failed_ = false;
};

}  // namespace plchost
