#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "shm/base/fault_record.hpp"
#include "shm/base/names.hpp"
#include "shm/base/seqlock.hpp"
#include "shm/base/task_kind.hpp"
#include "shm/base/task_statistics.hpp"
#include "shm/files/memory_file.hpp"

namespace plchost {

/// The task monitor's status word.
enum class PageTaskState : std::uint32_t { created = 0, running = 1, stopped = 2, exception = 3 };
[[nodiscard]] std::string_view to_string(PageTaskState state) noexcept;

/// The state of an instance's application. The numbers are part of the DDS API.
enum class ApplicationState : std::uint32_t {
  none = 0,          ///< there is no application
  stopped = 1,       ///< loaded; its tasks are parked
  running = 2,       ///< its tasks run under a scheduler
  single_cycle = 3,  ///< its cyclic and freewheeling tasks run one cycle each
  stopping = 4,      ///< its tasks come to the end of their cycles
  exception = 5,     ///< stopped by a fault; only a fresh process leads out of it
};
[[nodiscard]] std::string_view to_string(ApplicationState state) noexcept;

/// The constants of a loaded application.
struct TaskIdentity {
  FixedText<kMaxTaskName> name;
  FixedText<kMaxEventName> external_event;  ///< empty unless the kind names one
  TaskKind kind{};
  std::int32_t iec_priority = 0;
  std::int64_t interval_ns = 0;  ///< as configured; 0 unless the kind has one
};

/// The value of a plc_KeyValue.
inline constexpr std::size_t kMaxTickText = 127;

/// The distributed clock as the cyclic task of the highest priority sees it: see ClockStatus.
struct ClockRuntime {
  FixedText<kMaxObjectName> reference;  ///< name of the record; empty: none is named
  FixedText<kMaxTickText> problem;      ///< why there is none to follow; empty: there is
  std::uint32_t state = 0;              ///< 0 off, then free running, acquiring, locked, hold-over, measuring
  std::uint32_t in_sync = 0;
  std::int64_t offset_ns = 0;
  std::int64_t drift_ppb = 0;
  std::int64_t correction_ns = 0;
  std::int64_t correction_max_ns = 0;
  std::uint64_t corrections_at_bound = 0;
  std::uint64_t pairs = 0;
  std::uint64_t rejected = 0;
  std::uint64_t invalid = 0;
  std::uint64_t steps = 0;
};

/// The instance's report of itself. Written by its control thread.
struct InstanceRuntime {
  std::int32_t pid = 0;
  std::int32_t core = -1;     ///< read back from the kernel; -1 if bound to several
  std::uint32_t running = 0;  ///< 1 while the application runs
  std::uint32_t memory_locked = 0;
  std::int64_t heartbeat_ns = 0;  ///< CLOCK_MONOTONIC of the last beat
  FixedText<kMaxSchedulerName> scheduler;
  FixedText<kMaxPath> application;
  FixedText<kMaxTickText> tick_source;    ///< where the periodic tick comes from
  FixedText<kMaxTickText> tick_fallback;  ///< why that is not what the settings ask for; empty: it is
  FixedText<kMaxTickText> idle_states;    ///< the idle states of the processor that are held off, or why not
  ClockRuntime clock;
  ApplicationState state = ApplicationState::none;
  FixedText<kMaxPath> problem;         ///< why it is in exception; else empty
  std::uint32_t variables = 0;         ///< that its application has declared
  std::uint32_t forces = 0;            ///< of them, elements that are forced
  FixedText<kMaxPath> retain_problem;  ///< why its newest retain values are in no file; empty: they are
};

struct TaskSlot {
  TaskIdentity identity;
  std::atomic<std::uint32_t> state{0};  ///< a PageTaskState
  Seqlock<TaskCounters> counters;
  Seqlock<FaultRecord> fault;  ///< written once, by its finder; never: it has none
};

inline constexpr std::uint32_t kMaxTasks = 1024;

struct InstancePageLayout {
  std::uint64_t magic = 0;  ///< written last
  std::uint32_t version = 0;
  std::uint32_t task_count = 0;
  std::uint64_t size = 0;
  std::uint32_t digits = 0;  ///< of the histograms: HistogramShape::kCoarse or kFine
  std::uint32_t reserved = 0;
  Seqlock<InstanceRuntime> runtime;
  // TaskSlot tasks[task_count] follow, and then, at a multiple of 64,
  // std::uint32_t buckets[task_count][kTaskHistograms][bucket_count]
};

[[nodiscard]] std::string instance_page_name(std::string_view pool, std::string_view instance);
/// The file whose lock says that a process runs under that name.
[[nodiscard]] std::string instance_claim_name(std::string_view pool, std::string_view instance);

/// The process's knowledge of the fault of a task.
struct KnownFault {
  bool raised = false;                  ///< its record may be written at any time
  const FaultRecord* record = nullptr;  ///< null: not complete yet
};

/// The instance's end: a fresh page for each life of the process, made when its tasks are known.
class InstancePage {
 public:
  /// `fine_tasks`: up to so many tasks have histograms of 3 digits. invalid_argument: more than kMaxTasks
  /// tasks.
  [[nodiscard]] static Result<InstancePage> create(std::string_view pool, std::string_view instance,
                                                   std::span<const TaskIdentity> tasks,
                                                   std::uint32_t fine_tasks = kMaxFineTasks);
  /// And the file that its process holds its name with: it has ended.
  static void remove(std::string_view pool, std::string_view instance) noexcept;

  void write_runtime(const InstanceRuntime& runtime) noexcept;
  /// `index` < task_count().
  [[nodiscard]] TaskSlot& task(std::uint32_t index) noexcept;
  /// The state of task `index` < task_count(). Control thread.
  void set_task_state(std::uint32_t index, PageTaskState state) noexcept;
  [[nodiscard]] PageTaskState task_state(std::uint32_t index) const noexcept { return states_[index]; }
  /// Writes the header, what tasks are, their states and their faults anew where another program has written
  /// over them. true: one had. The counters of a task are written anew by its next cycle. Control thread.
  [[nodiscard]] bool keep(const std::function<KnownFault(std::uint32_t)>& fault);
  /// Where task `index` < task_count() writes its statistics. As long as the page.
  [[nodiscard]] TaskStatistics& statistics(std::uint32_t index) noexcept { return statistics_[index]; }
  [[nodiscard]] std::uint32_t task_count() const noexcept { return task_count_; }
  /// Its file was cut short by a stranger: nobody sees what is written any more. Any context.
  [[nodiscard]] bool lost() const noexcept { return memory_.lost(); }

 private:
  InstancePage(MemoryFile memory, std::span<const TaskIdentity> tasks, HistogramShape shape);
  [[nodiscard]] bool keep_task(std::uint32_t index, const KnownFault& fault) noexcept;
  MemoryFile memory_;
  // A stranger may change the page's own.
  std::uint32_t task_count_;
  HistogramShape shape_;
  std::vector<TaskIdentity> identities_;
  std::vector<PageTaskState> states_;
  std::vector<TaskStatistics> statistics_;  // they refer into the memory
};

/// One task as a reader sees it.
struct TaskSnapshot {
  TaskIdentity identity;
  PageTaskState state = PageTaskState::created;
  TaskCounters counters{};
};

/// A reader's end, in any process. It reads the page of the process that lived when it was opened: open anew
/// when the instance has another pid.
class InstancePageReader {
 public:
  /// not_found: the instance has made none. corrupt: not such a page, or of impossible size.
  [[nodiscard]] static Result<InstancePageReader> open(std::string_view pool, std::string_view instance);
  [[nodiscard]] std::optional<InstanceRuntime> runtime() const noexcept;
  [[nodiscard]] std::uint32_t task_count() const noexcept { return task_count_; }
  /// The constants of a task, so no writer is in the way. Nothing: a stranger has written over it.
  [[nodiscard]] std::optional<TaskIdentity> identity(std::uint32_t index) const noexcept;
  /// Never in the way of a writer. Nothing: a stranger has written over it.
  [[nodiscard]] std::optional<PageTaskState> task_state(std::uint32_t index) const noexcept;
  /// Nothing if the writer was in the way; try again later.
  [[nodiscard]] std::optional<TaskSnapshot> task(std::uint32_t index) const noexcept;
  /// The histogram as it is now and goes on growing; `index` < task_count().
  [[nodiscard]] HistogramView histogram(std::uint32_t index, TaskHistogram which) const noexcept;
  [[nodiscard]] HistogramShape histogram_shape() const noexcept { return shape_; }
  /// The fault that put the task into exception; nothing: none did.
  [[nodiscard]] std::optional<FaultRecord> fault(std::uint32_t index) const noexcept;
  /// Changes when the task ran: readers that publish look at this first.
  [[nodiscard]] std::uint64_t task_sequence(std::uint32_t index) const noexcept;

 private:
  InstancePageReader(MemoryFile memory, std::uint32_t count, HistogramShape shape) noexcept
      : memory_(std::move(memory)), task_count_(count), shape_(shape) {}
  MemoryFile memory_;
  // As validated at open: a stranger may change the page's own.
  std::uint32_t task_count_ = 0;
  HistogramShape shape_;
};

}  // namespace plchost
