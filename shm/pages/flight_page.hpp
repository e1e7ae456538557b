#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "shm/base/flight_ring.hpp"
#include "shm/base/names.hpp"
#include "shm/base/seqlock.hpp"
#include "shm/files/memory_file.hpp"

namespace plchost {

/// Why a task lost cycles. The numbers are part of the DDS API.
enum class LossCause : std::uint32_t {
  unknown = 0,     ///< the record of that time was written over before it was looked at
  long_cycle = 1,  ///< the cycle before took longer than the interval by itself
  task_above = 2,  ///< tasks of the instance with at least its priority had the core
  stall = 3,       ///< none of the instance's threads had it: the machine stood still, or another process ran
  scheduler = 4,   ///< an exchange of the scheduler
  online_change = 5,   ///< an online change, or values that were written between two cycles
  halt = 6,            ///< a debugger held the task
  start = 7,           ///< the tasks were started meanwhile
  runtime = 8,         ///< the runtime's own work behind the cycle, as giving retain variables
  event_variable = 9,  ///< the reading of event variables, which goes before all tasks
};

/// Cycles that a task lost, with their cause. Times by CLOCK_MONOTONIC unless said otherwise.
struct LossRecord {
  std::uint64_t number = 0;     ///< of the losses of this process, from 1 on; 0: no loss
  std::int64_t unix_ns = 0;     ///< `ready_ns` by CLOCK_REALTIME
  std::int64_t release_ns = 0;  ///< planned release of the cycle before
  std::int64_t ready_ns = 0;    ///< the task was ready again: the releases until then are lost
  std::int64_t interval_ns = 0;
  std::uint64_t lost = 0;
  LossCause cause = LossCause::unknown;
  FixedText<kMaxTaskName> task;
  FixedText<kMaxTaskName> holder;  ///< task_above: the one that had the core longest
  // The time from release_ns to ready_ns in parts.
  std::int64_t own_ns = 0;    ///< the task had the core
  std::int64_t above_ns = 0;  ///< tasks with at least its priority had it
  std::int64_t stall_ns = 0;  ///< nothing of the instance had it
  std::int64_t other_ns = 0;  ///< by none of these: scheduler, online_change, halt, runtime, event_variable
};

/// A task as the rings are numbered.
struct FlightTask {
  FixedText<kMaxTaskName> name;
  std::int32_t iec_priority = 0;
  std::uint32_t event_mark = 0;  ///< of the event that it runs for, see event_mark(); 0: none
};

/// Tells the events of a host from each other in an entry. `object`: the event's name in the pool.
[[nodiscard]] std::uint32_t event_mark(std::string_view object) noexcept;

/// The flight recorder of one instance: the rings of its threads, and the last losses with their causes.
inline constexpr std::size_t kLossesKept = 64;
/// Of these at most so many of one task, as long as there is no room for more.
inline constexpr std::size_t kLossesOfTask = 8;

/// The numbers of the rings: the control thread's, the supervision's, that of the reader of event variables,
/// then one for each task.
inline constexpr std::size_t kControlRing = 0;
inline constexpr std::size_t kWatchRing = 1;
inline constexpr std::size_t kPollRing = 2;
inline constexpr std::size_t kFirstTaskRing = 3;

/// Entries of each ring: from 4096 with up to 29 tasks (2 s at 1 kHz) to 128 with 1024. A power of two.
[[nodiscard]] std::size_t flight_capacity(std::size_t tasks) noexcept;

struct FlightPageLayout {
  std::uint64_t magic = 0;  ///< written last
  std::uint32_t version = 0;
  std::uint32_t task_count = 0;
  std::uint64_t size = 0;
  std::uint32_t capacity = 0;  ///< entries of a ring
  std::uint32_t pid = 0;
  Seqlock<LossRecord> losses[kLossesKept];
  // FlightTask tasks[task_count], and at a multiple of 64
  // FlightCount counts[rings] and words[rings][capacity][2] follow
};

[[nodiscard]] std::string flight_page_name(std::string_view pool, std::string_view instance);

/// The instance's end: a fresh page for each process, made when its tasks are known. It stays when the
/// process is killed, until the next one or the manager removes it.
class FlightPage {
 public:
  [[nodiscard]] static Result<FlightPage> create(std::string_view pool, std::string_view instance,
                                                 std::span<const FlightTask> tasks);
  static void remove(std::string_view pool, std::string_view instance) noexcept;

  /// The writer's end of ring `number`: one thread's. As long as the page.
  [[nodiscard]] FlightRing ring(std::size_t number) noexcept;
  /// See FlightRing::read(). Soft threads.
  [[nodiscard]] FlightRing::Read read(std::size_t number, std::uint64_t from) const;
  /// The entries of the ring so far.
  [[nodiscard]] std::uint64_t written(std::size_t number) const noexcept;
  [[nodiscard]] const std::vector<FlightTask>& tasks() const noexcept { return tasks_; }

  /// Keeps the loss of task number `task` with the next number, in place of the oldest one of it, or of all.
  /// Control thread.
  void add_loss(std::size_t task, LossRecord record) noexcept;
  /// Writes the header anew, in case another program has written over it. Control thread.
  void keep() noexcept;

 private:
  FlightPage(MemoryFile memory, std::span<const FlightTask> tasks);

  MemoryFile memory_;
  std::vector<FlightTask> tasks_;
  std::size_t capacity_;
  // Of each place of a loss: its task and number.
  struct Kept {
    std::size_t task = 0;
    std::uint64_t number = 0;
  };
  std::vector<Kept> kept_;
  std::uint64_t losses_ = 0;
};

/// A reader's end, in any process: of the process that lived when it was opened.
class FlightPageReader {
 public:
  /// not_found: the instance has made none. corrupt: not such a page, or of impossible size.
  [[nodiscard]] static Result<FlightPageReader> open(std::string_view pool, std::string_view instance);
  [[nodiscard]] std::int32_t pid() const noexcept { return pid_; }
  [[nodiscard]] std::size_t task_count() const noexcept { return task_count_; }
  /// Printable. `index` < task_count().
  [[nodiscard]] std::string task_name(std::size_t index) const;
  [[nodiscard]] std::uint32_t event_mark(std::size_t index) const noexcept;
  [[nodiscard]] std::int32_t iec_priority(std::size_t index) const noexcept;
  /// Ring `number` < kFirstTaskRing + task_count(). Entries that a stranger has written are not left out.
  [[nodiscard]] FlightRing::Read read(std::size_t number, std::uint64_t from) const;
  /// The entries behind the last one that is not later than `time_ns`. It looks at few more than these.
  [[nodiscard]] FlightRing::Read read_after(std::size_t number, std::int64_t time_ns) const;
  /// Place `place` < kLossesKept; nothing: none there. Its text is printable.
  [[nodiscard]] std::optional<LossRecord> loss(std::size_t place) const noexcept;
  /// Changes with each loss in that place.
  [[nodiscard]] std::uint64_t loss_sequence(std::size_t place) const noexcept;

 private:
  FlightPageReader(MemoryFile memory, std::size_t task_count, std::size_t capacity, std::int32_t pid) noexcept
      : memory_(std::move(memory)), task_count_(task_count), capacity_(capacity), pid_(pid) {}
  MemoryFile memory_;
  // A stranger may change the page's own.
  std::size_t task_count_;
  std::size_t capacity_;
  std::int32_t pid_;
};

}  // namespace plchost
