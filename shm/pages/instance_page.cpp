#include "shm/pages/instance_page.hpp"

#include <cassert>
#include <cstddef>
#include <cstring>
#include <new>
#include <type_traits>
#include <utility>

#include <fmt/format.h>

#include "shm/files/fixed_page.hpp"

namespace plchost {

namespace {

/// 1: first. 2: the interval in force. 3: the tick source. 4: histograms behind the tasks, in two
/// shapes. 5: the idle states. 6: the distributed clock. 7: state and problem of the application.
/// 8: why a reference record is not followed. 9: faults. 10: the post that was run.
/// 11: why retain variables are not written. 13: the last loss of cycles.
/// 14: variables and forces.
constexpr PageKind kInstancePageKind{.what = "page of an instance",
                                     .magic = 0x67617074'736e6970,  // "pinstpag"
                                     .version = 14};
constexpr std::size_t kTasksOffset = (sizeof(InstancePageLayout) + 63) / 64 * 64;

static_assert(offsetof(InstancePageLayout, version) == 8 && offsetof(InstancePageLayout, size) == 16);
static_assert(sizeof(TaskIdentity) == 120 && alignof(TaskSlot) <= 64);

HistogramShape shape_for(std::size_t task_count, std::uint32_t fine_tasks) noexcept {
  return HistogramShape(task_count <= fine_tasks ? HistogramShape::kFine : HistogramShape::kCoarse);
}

std::size_t buckets_offset(std::size_t task_count) noexcept {
  return (kTasksOffset + task_count * sizeof(TaskSlot) + 63) / 64 * 64;
}

std::size_t size_for(std::size_t task_count, HistogramShape shape) noexcept {
  return buckets_offset(task_count) + task_count * task_bucket_count(shape) * sizeof(std::uint32_t);
}

InstancePageLayout& instance_layout_of(const MemoryFile& memory) noexcept {
  return *reinterpret_cast<InstancePageLayout*>(memory.bytes().data());
}

TaskSlot& slot_of(const MemoryFile& memory, std::uint32_t index) noexcept {
  return reinterpret_cast<TaskSlot*>(memory.bytes().data() + kTasksOffset)[index];
}

/// The buckets of one task.
HistogramBuckets buckets_of(const MemoryFile& memory, std::uint32_t task_count, std::uint32_t index,
                            HistogramShape shape) noexcept {
  using Bucket = HistogramBuckets::element_type;
  static_assert(sizeof(Bucket) == sizeof(std::uint32_t) && Bucket::is_always_lock_free);
  auto* const all = reinterpret_cast<Bucket*>(memory.bytes().data() + buckets_offset(task_count));
  return {all + index * task_bucket_count(shape), task_bucket_count(shape)};
}

void write_header(InstancePageLayout& page, std::size_t tasks, HistogramShape shape) noexcept {
  page.digits = shape.digits();
  page.task_count = static_cast<std::uint32_t>(tasks);
  describe_page(page, kInstancePageKind, size_for(tasks, shape));
}

bool has_good_header(const InstancePageLayout& page, std::size_t tasks, HistogramShape shape) noexcept {
  return page.digits == shape.digits() && page.task_count == tasks &&
         is_described(page, kInstancePageKind, size_for(tasks, shape));
}

// As a whole: a program that has written over it may have changed any byte.
template <class Value>
bool is_same(const Value& one, const Value& other) noexcept {
  static_assert(std::is_trivially_copyable_v<Value>);
  return std::memcmp(static_cast<const void*>(&one), static_cast<const void*>(&other), sizeof one) == 0;
}

// The memory is zero, as the buckets are at first.
Result<void> fill_instance_page(std::span<std::byte> bytes, std::span<const TaskIdentity> tasks,
                                HistogramShape shape) {
  auto* const page = new (bytes.data()) InstancePageLayout;
  auto* place = bytes.data() + kTasksOffset;
  for (const TaskIdentity& identity : tasks) {
    auto* const slot = new (place) TaskSlot;
    slot->identity = identity;
    place += sizeof(TaskSlot);
  }
  write_header(*page, tasks.size(), shape);
  return {};
}

}  // namespace

std::string_view to_string(PageTaskState state) noexcept {
  switch (state) {
    case PageTaskState::created:
      return "created";
    case PageTaskState::running:
      return "running";
    case PageTaskState::stopped:
      return "stopped";
    case PageTaskState::exception:
      return "exception";
  }
  return "unknown";
}

std::string_view to_string(ApplicationState state) noexcept {
  switch (state) {
    case ApplicationState::none:
      return "none";
    case ApplicationState::stopped:
      return "stopped";
    case ApplicationState::running:
      return "running";
    case ApplicationState::single_cycle:
      return "single cycle";
    case ApplicationState::stopping:
      return "stopping";
    case ApplicationState::exception:
      return "exception";
  }
  return "unknown";
}

std::string instance_page_name(std::string_view pool, std::string_view instance) {
  return fmt::format("{}.instance.{}", pool, instance);
}

std::string instance_claim_name(std::string_view pool, std::string_view instance) {
  return fmt::format("{}.claim.{}", pool, instance);
}

Result<InstancePage> InstancePage::create(std::string_view pool, std::string_view instance,
                                          std::span<const TaskIdentity> tasks, std::uint32_t fine_tasks) {
  if (tasks.size() > kMaxTasks) {
    return failure(
        ErrorCode::invalid_argument,
        fmt::format("instance '{}' has {} tasks; at most {} are allowed", instance, tasks.size(), kMaxTasks));
  }
  const HistogramShape shape = shape_for(tasks.size(), fine_tasks);
  PLCHOST_TRY_ASSIGN(
      auto memory, MemoryFile::replace(
                       instance_page_name(pool, instance), size_for(tasks.size(), shape),
                       [&](std::span<std::byte> bytes) { return fill_instance_page(bytes, tasks, shape); }));
  return InstancePage(std::move(memory), tasks, shape);
}

InstancePage::InstancePage(MemoryFile memory, std::span<const TaskIdentity> tasks, HistogramShape shape)
    : memory_(std::move(memory)),
      task_count_(static_cast<std::uint32_t>(tasks.size())),
      shape_(shape),
      identities_(tasks.begin(), tasks.end()),
      states_(tasks.size(), PageTaskState::created) {
  statistics_.reserve(task_count_);
  for (std::uint32_t i = 0; i < task_count_; ++i) {
    statistics_.emplace_back(shape, slot_of(memory_, i).counters, buckets_of(memory_, task_count_, i, shape));
  }
}

void InstancePage::set_task_state(std::uint32_t index, PageTaskState state) noexcept {
  states_[index] = state;
  slot_of(memory_, index).state.store(std::to_underlying(state), std::memory_order_relaxed);
}

bool InstancePage::keep(const std::function<KnownFault(std::uint32_t)>& fault) {
  InstancePageLayout& page = instance_layout_of(memory_);
  bool changed = !has_good_header(page, task_count_, shape_);
  if (changed) write_header(page, task_count_, shape_);
  for (std::uint32_t i = 0; i < task_count_; ++i) {
    if (keep_task(i, fault(i))) changed = true;
  }
  return changed;
}

bool InstancePage::keep_task(std::uint32_t index, const KnownFault& fault) noexcept {
  TaskSlot& slot = slot_of(memory_, index);
  bool changed = false;
  if (!is_same(slot.identity, identities_[index])) {
    slot.identity = identities_[index];
    changed = true;
  }
  if (slot.state.load(std::memory_order_relaxed) != std::to_underlying(states_[index])) {
    set_task_state(index, states_[index]);
    changed = true;
  }
  if (!fault.raised) {
    if (slot.fault.sequence() == 0) return changed;
    // If it is raised just now, its record is written again by the next call.
    new (&slot.fault) Seqlock<FaultRecord>;
    return true;
  }
  if (fault.record == nullptr) return changed;  // its finder is about to write it
  const auto shown = slot.fault.read();
  if (shown && slot.fault.sequence() != 0 && is_same(*shown, *fault.record)) return changed;
  slot.fault.write(*fault.record);
  return true;
}

void InstancePage::remove(std::string_view pool, std::string_view instance) noexcept {
  MemoryFile::remove(instance_page_name(pool, instance));
  MemoryFile::remove(instance_claim_name(pool, instance));
}

void InstancePage::write_runtime(const InstanceRuntime& runtime) noexcept {
  instance_layout_of(memory_).runtime.write(runtime);
}

TaskSlot& InstancePage::task(std::uint32_t index) noexcept {
  assert(index < task_count_);
  return slot_of(memory_, index);
}

Result<InstancePageReader> InstancePageReader::open(std::string_view pool, std::string_view instance) {
  const std::string name = instance_page_name(pool, instance);
  PLCHOST_TRY_ASSIGN(auto memory,
                     open_page<InstancePageLayout>(name, kInstancePageKind, MemoryFile::Access::read_only));
  const InstancePageLayout& page = instance_layout_of(memory);
  // Read once: a stranger may write to the page at any time.
  const std::uint32_t count = page.task_count;
  const std::uint32_t digits = page.digits;
  const std::uint64_t size = page.size;
  const bool possible = count <= kMaxTasks && HistogramShape::is_valid(digits) &&
                        size == size_for(count, HistogramShape(digits)) && size == memory.bytes().size();
  if (!possible) {
    return failure(ErrorCode::corrupt,
                   fmt::format("page '{}' says {} tasks with histograms of {} digits; this does not fit its "
                               "size of {} bytes",
                               name, count, digits, memory.bytes().size()));
  }
  return InstancePageReader(std::move(memory), count, HistogramShape(digits));
}

std::optional<InstanceRuntime> InstancePageReader::runtime() const noexcept {
  return instance_layout_of(memory_).runtime.read();
}

std::optional<TaskIdentity> InstancePageReader::identity(std::uint32_t index) const noexcept {
  if (index >= task_count_) return std::nullopt;
  const TaskIdentity identity = slot_of(memory_, index).identity;
  if (find_traits(identity.kind) == nullptr) return std::nullopt;
  return identity;
}

std::optional<PageTaskState> InstancePageReader::task_state(std::uint32_t index) const noexcept {
  if (index >= task_count_) return std::nullopt;
  const TaskSlot& slot = slot_of(memory_, index);
  if (slot.fault.is_written()) return PageTaskState::exception;
  const auto state = static_cast<PageTaskState>(slot.state.load(std::memory_order_acquire));
  if (state > PageTaskState::exception) return std::nullopt;
  return state;
}

std::optional<TaskSnapshot> InstancePageReader::task(std::uint32_t index) const noexcept {
  if (index >= task_count_) return std::nullopt;
  const auto counters = slot_of(memory_, index).counters.read();
  const auto state = task_state(index);
  const auto known = identity(index);
  if (!counters || !state || !known) return std::nullopt;
  return TaskSnapshot{.identity = *known, .state = *state, .counters = *counters};
}

std::optional<FaultRecord> InstancePageReader::fault(std::uint32_t index) const noexcept {
  if (index >= task_count_) return std::nullopt;
  const Seqlock<FaultRecord>& fault = slot_of(memory_, index).fault;
  return fault.sequence() != 0 ? fault.read() : std::nullopt;
}

HistogramView InstancePageReader::histogram(std::uint32_t index, TaskHistogram which) const noexcept {
  assert(index < task_count_);
  const ConstHistogramBuckets all = buckets_of(memory_, task_count_, index, shape_);
  return {shape_, TaskStatistics::part(shape_, all, which)};
}

std::uint64_t InstancePageReader::task_sequence(std::uint32_t index) const noexcept {
  return index < task_count_ ? slot_of(memory_, index).counters.sequence() : 0;
}

}  // namespace plchost
