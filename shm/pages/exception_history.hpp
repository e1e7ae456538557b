#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <sys/types.h>

#include "shm/base/fault_record.hpp"
#include "shm/base/result.hpp"
#include "shm/base/task_kind.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// The circumstances of an exception, as they were then. Only the process knows all of them.
struct ExceptionCircumstances {
  std::string version;         ///< of plchost; empty: not known
  std::string build;           ///< compiler and build ID, as the application's file has them; empty: neither
  std::string scheduler;       ///< empty: not known
  std::string settings;        ///< of the task: see task_settings(); empty: not known
  std::uint64_t cycles = 0;    ///< of the task that had ended
  std::int64_t uptime_ns = 0;  ///< of the process; 0: not known
  bool operator==(const ExceptionCircumstances&) const = default;
};

/// One exception of an application, as it is kept and shown.
struct ExceptionEntry {
  std::uint64_t number = 0;  ///< among all exceptions of this instance, from 1
  std::int64_t unix_ns = 0;  ///< CLOCK_REALTIME
  std::string application;   ///< path of the file
  std::string task;
  std::string kind;               ///< "signal", "cpp_exception", "task_watchdog" ...
  bool whole_application = true;  ///< false: only the task was stopped
  std::string signal;             ///< "SIGSEGV"; empty: none
  std::uint64_t address = 0;      ///< of the instruction; 0: not known
  /// "fill(int)+0x12 in bottling.so at bottling.cpp:41", without the line where none is known; empty: not
  /// known
  std::string symbol;
  std::uint64_t memory_address = 0;  ///< the address of SIGSEGV and SIGBUS
  std::string text;                  ///< the cause, with its figures
  /// Of its functions each as `symbol` has it, the innermost first; "0x7f12" where no file is known.
  std::vector<std::string> back_trace;
  std::string back_trace_end;           ///< why there are no more; empty: it is whole
  std::vector<std::string> activity{};  ///< of all tasks before it, see activity_before()
  ExceptionCircumstances circumstances{};
  bool operator==(const ExceptionEntry&) const = default;
};

/// The exceptions of one instance, the oldest first. Kept in a file, so that they outlive a reset, the
/// process and the manager.
struct ExceptionHistory {
  static constexpr std::size_t kMaxEntries = 16;

  std::uint64_t count = 0;  ///< of all that ever were
  std::vector<ExceptionEntry> entries;

  /// Numbers it and drops the oldest, if there are too many. Of one that is there already, by its task and
  /// time, the one with a symbol stays: the manager, which finds none, may have come first, or come last.
  void add(ExceptionEntry entry);
  /// Adds what another history has of the same instance, which keeps its numbers if they are greater.
  void take(const ExceptionHistory& other);
  bool operator==(const ExceptionHistory&) const = default;
};

/// Without symbols and back-trace, which only the process can find.
[[nodiscard]] ExceptionEntry exception_entry(const FaultRecord& record, std::string_view application,
                                             std::string_view task);

/// "cyclic, interval 10 ms, priority 4, core 1". `core` -1: it is bound to several.
[[nodiscard]] std::string task_settings(TaskKind kind, Duration interval, int priority, int core);

/// RUN_DIRECTORY/INSTANCE.exception
[[nodiscard]] std::string exception_path(std::string_view run_directory, std::string_view instance);

/// A file that is not there is an empty history. corrupt: it is something else; the text says what.
[[nodiscard]] Result<ExceptionHistory> read_exceptions(const std::string& path);
/// Replaces the file as a whole: a reader finds the one before or the new one. `mode`: as in replace_file().
/// Set-up.
[[nodiscard]] Result<void> write_exceptions(const std::string& path, const ExceptionHistory& history,
                                            mode_t mode = 0644);
/// Adds to the file what was found; if it has all of it already, it stays as it is. A file that cannot be
/// read is begun anew: then the remark says what was lost; else it is empty. Set-up.
[[nodiscard]] Result<std::string> keep_exceptions(const std::string& path,
                                                  std::span<const ExceptionEntry> found);
/// The same for an instance, whether it says so itself or its manager does. The log says what is lost.
/// Set-up.
void keep_exceptions_of(std::string_view run_directory, std::string_view instance,
                        std::span<const ExceptionEntry> found);

}  // namespace plchost
