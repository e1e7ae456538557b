// How Areas places what the application declared: once, before its tasks are made.

#include <algorithm>
#include <numeric>
#include <utility>

#include <fmt/format.h>

#include "instances/launch/launch_contract.hpp"
#include "instances/runtime/areas/areas.hpp"

namespace plchost {

namespace {

// The bytes of `all` that are in none of `ranges`.
std::vector<ByteRange> rest_of(ByteRange all, std::vector<ByteRange> ranges) {
  std::ranges::sort(ranges, {}, &ByteRange::offset);
  std::vector<ByteRange> rest;
  std::size_t at = all.offset;
  for (const ByteRange range : ranges) {
    if (range.offset > at) rest.push_back({.offset = at, .bytes = range.offset - at});
    at = range.offset + range.bytes;
  }
  const std::size_t end = all.offset + all.bytes;
  if (end > at) rest.push_back({.offset = at, .bytes = end - at});
  return rest;
}

// Where the next kept area lies behind one that ends at `bytes`.
std::size_t behind_kept(std::size_t bytes) noexcept {
  return (bytes + kRetainAlignment - 1) / kRetainAlignment * kRetainAlignment;
}

Result<void> check_kept_bytes(std::uint64_t bytes) {
  if (bytes <= kMaxRetainBytes) return {};
  return failure(
      ErrorCode::invalid_argument,
      fmt::format("the retain and persistent areas have {} bytes, {} are allowed", bytes, kMaxRetainBytes));
}

}  // namespace

Result<void> Areas::check(std::span<const AreaSettings> settings, std::span<const TaskConfig> tasks) const {
  if (declared_.empty()) return {};
  std::vector<DeclaredArea> areas = declared_;
  std::vector<std::string> names;
  for (const TaskConfig& task : tasks) names.push_back(task.name);
  if (auto done = complete_uses(areas, names); !done) return done;
  if (const auto plan = plan_areas(areas, settings); !plan) return std::unexpected(plan.error());
  std::size_t kept = 0;
  for (const DeclaredArea& area : areas) {
    if (area.is_kept()) kept = behind_kept(kept + area.bytes);
  }
  return check_kept_bytes(kept);
}

Result<std::string> Areas::place(const Environment& environment, std::span<TaskConfig> tasks) {
  open_ = false;
  if (declared_.empty()) return std::string();
  for (const TaskConfig& task : tasks) tasks_.push_back(task.name);
  if (auto done = complete_uses(declared_, tasks_); !done) return std::unexpected(done.error());
  auto plan = plan_areas(declared_, environment.settings);
  if (!plan) return std::unexpected(std::move(plan).error());
  plan_ = *std::move(plan);
  cycles_.resize(tasks.size());
  plain_.resize(declared_.size(), nullptr);
  if (auto made = make_blocks(environment); !made) return std::unexpected(made.error());
  if (auto distinct = check_distinct(environment); !distinct) return std::unexpected(distinct.error());
  for (std::size_t i = 0; i < blocks_.size(); ++i) {
    if (first_of(plan_.blocks[i]).has_image()) make_image(blocks_[i], plan_.blocks[i]);
  }
  if (auto made = make_keeper(environment); !made) return std::unexpected(made.error());
  tell_plain_addresses();
  for (std::size_t block = 0; block < plan_.blocks.size(); ++block) make_views(block);
  count_cycles(tasks);
  wrap(tasks);
  placed_ = true;
  if (!keeper_) return std::string();
  if (auto started = keeper_->start(); !started) return std::unexpected(started.error());
  return fmt::format("{}", fmt::join(keeper_->remarks(), "; "));
}

Result<void> Areas::make_blocks(const Environment& environment) {
  for (const AreaBlock& planned : plan_.blocks) {
    Block& block = blocks_.emplace_back();
    if (planned.settings == nullptr && first_of(planned).is_kept()) continue;  // RetainKeeper's
    block.initial.resize(planned.bytes);
    for (const std::size_t area : planned.areas) {
      std::ranges::copy(declared_[area].initial,
                        block.initial.begin() + static_cast<std::ptrdiff_t>(plan_.places[area].offset));
    }
    if (auto made = make_memory(environment, block, planned); !made) return made;
  }
  return {};
}

Result<void> Areas::make_memory(const Environment& environment, Block& block, const AreaBlock& planned) {
  const DeclaredArea& first = first_of(planned);
  const auto take = [&](Result<AreaMemory> made) -> Result<void> {
    if (!made) return std::unexpected(std::move(made).error());
    block.memory = *std::move(made);
    return {};
  };
  if (planned.settings == nullptr) {
    // Inputs that nobody writes and outputs that nobody reads need no memory but the tasks'.
    if (first.is_input() || (first.is_output() && first.uses.size() == 1)) return {};
    return take(AreaMemory::of_process(first.is_output() ? plc_image_bytes(first.bytes) : planned.bytes));
  }
  const AreaSettings& settings = *planned.settings;
  block.source = fmt::format("{}: [SysMem] Area.{}: {}", settings.where, settings.number,
                             settings.object.empty() ? settings.device : settings.object);
  if (settings.object.empty()) return take(AreaMemory::of_device(settings));
  const auto size = static_cast<std::uint32_t>(settings.size);
  const std::size_t bytes = first.has_image() ? plc_image_bytes(size) : settings.size;
  auto made = AreaMemory::of_pool(environment.pool, settings.object, bytes, first.is_output());
  if (!made) {
    return failure_in(fmt::format("{}: [SysMem] Area.{}", settings.where, settings.number),
                      std::move(made).error());
  }
  return take(std::move(made));
}

// The settings are checked by their texts; but a file has many: symbolic and hard links, and that of a memory
// of the pool, one of which holds what is kept.
Result<void> Areas::check_distinct(const Environment& environment) const {
  struct Taken {
    const AreaSettings* settings;
    std::string by;
    FileRange range;
  };
  std::vector<Taken> taken;
  const std::string kept = kept_memory_name(environment.instance);
  if (const auto range = range_of_memory(environment.pool.name(), kept);
      range && std::ranges::any_of(declared_, &DeclaredArea::is_kept)) {
    taken.push_back({.settings = nullptr,
                     .by = fmt::format("the retain variables of the instance, memory '{}' of the pool", kept),
                     .range = *range});
  }
  for (std::size_t i = 0; i < blocks_.size(); ++i) {
    const AreaSettings* const settings = plan_.blocks[i].settings;
    if (settings == nullptr) continue;
    const auto range = settings->object.empty() ? blocks_[i].memory.range()
                                                : range_of_memory(environment.pool.name(), settings->object);
    if (!range) continue;
    if (const auto own = own_file_of_pool(environment.pool.name(), *range)) {
      return failure(ErrorCode::invalid_argument,
                     fmt::format("{}: [SysMem] Area.{}: {} is {}, in which the host manages its pool; choose "
                                 "another file, or Object=NAME for a memory of the pool",
                                 settings->where, settings->number, settings->device, *own));
    }
    for (const Taken& other : taken) {
      if (other.settings == settings || !range->overlaps(other.range)) continue;
      return failure(
          ErrorCode::invalid_argument,
          fmt::format("{}: [SysMem] Area.{}: {} is the same file as that of {}, and they overlap; each "
                      "needs bytes of its own",
                      settings->where, settings->number,
                      settings->object.empty() ? settings->device : settings->object, other.by));
    }
    taken.push_back({.settings = settings,
                     .by = fmt::format("Area.{} of {}", settings->number, settings->where),
                     .range = *range});
  }
  return {};
}

// Several areas of a block are one image: a task sees all of them as they were at one time.
void Areas::make_image(Block& block, const AreaBlock& planned) {
  const bool of_device = planned.settings != nullptr && planned.settings->object.empty();
  if (of_device || block.memory.bytes().empty()) return;
  const auto size =
      static_cast<std::uint32_t>(planned.settings != nullptr ? planned.bytes : first_of(planned).bytes);
  auto* const header = reinterpret_cast<plc_image_header*>(block.memory.bytes().data());
  // Made by firmware, it is one already; whatever else was there is none of theirs.
  if (plc_image_is_one(header, size) == 0) plc_image_begin(header, size);
  block.initial.resize(size);
  if (first_of(planned).is_input()) {
    block.inputs = image_in(block.memory.bytes(), size);
  } else {
    block.outputs = std::make_unique<OutputImage>(block.memory.bytes(), size);
    block.outputs->write(block.initial);
  }
}

Result<void> Areas::make_keeper(const Environment& environment) {
  RetainImage initial;
  initial.layout.application = environment.application;
  for (const DeclaredArea& area : declared_) {
    if (!area.is_kept()) continue;
    initial.layout.areas.push_back({.name = area.name,
                                    .flags = area.flags & (PLC_AREA_RETAIN | PLC_AREA_PERSISTENT),
                                    .bytes = area.bytes,
                                    .layout = area.layout,
                                    .offset = initial.data.size()});
    initial.data.insert(initial.data.end(), area.initial.begin(), area.initial.end());
    initial.data.resize(behind_kept(initial.data.size()));
  }
  if (initial.layout.areas.empty()) return {};
  initial.layout.bytes = initial.data.size();
  kept_ = initial.layout;
  if (auto good = check_kept_bytes(initial.layout.bytes); !good) return good;
  auto keeper = RetainKeeper::make(environment.pool, environment.instance, initial, environment.retain);
  if (!keeper) return std::unexpected(std::move(keeper).error());
  keeper_ = *std::move(keeper);
  return {};
}

void Areas::tell_plain_addresses() {
  for (std::size_t i = 0; i < declared_.size(); ++i) {
    const DeclaredArea& area = declared_[i];
    if (area.has_image()) continue;
    const AreaPlan::Place place = plan_.places[i];
    const AreaBlock& planned = plan_.blocks[place.block];
    const auto at_kept = [&] { return kept_.areas[kept_number(i)].offset; };
    if (area.is_kept() && planned.settings == nullptr) {
      plain_[i] = keeper_->memory().data().data() + at_kept();
    } else {
      const auto bytes = blocks_[place.block].memory.bytes().subspan(place.offset, area.bytes);
      plain_[i] = bytes.data();
      // What lies in a device or in the pool and is not kept, others may have written: it stays.
      if (area.is_kept()) keeper_->memory().live_elsewhere(at_kept(), bytes);
      if (!area.is_kept() && !blocks_[place.block].memory.existed())
        std::ranges::copy(area.initial, bytes.begin());
    }
    if (area.address != nullptr) *area.address = plain_[i];
    for (const AreaUse& use : area.uses) {
      if (use.address != nullptr) *use.address = plain_[i];
    }
  }
}

std::size_t Areas::task_number(const std::string& name) const {
  return static_cast<std::size_t>(std::ranges::find(tasks_, name) - tasks_.begin());
}

// Of the tasks that use any area of the block.
std::vector<std::size_t> Areas::users_of(std::size_t index) const {
  std::vector<std::size_t> users;
  for (const std::size_t area : plan_.blocks[index].areas) {
    for (const AreaUse& use : declared_[area].uses) users.push_back(task_number(use.task));
  }
  std::ranges::sort(users);
  users.erase(std::ranges::unique(users).begin(), users.end());
  return users;
}

OutputView::Writes Areas::writes_of(std::size_t index, std::size_t task) const {
  OutputView::Writes writes;
  for (const std::size_t area : plan_.blocks[index].areas) {
    const DeclaredArea& declared = declared_[area];
    const auto place = static_cast<std::size_t>(plan_.places[area].offset);
    std::vector<ByteRange> owned;  // by any task
    bool uses = false;
    for (const AreaUse& use : declared.uses) {
      const ByteRange range{.offset = place + use.offset, .bytes = use.bytes};
      if (range.bytes > 0) owned.push_back(range);
      if (task_number(use.task) != task) continue;
      uses = true;
      if (range.bytes > 0) writes.own.push_back(range);
    }
    if (!uses) continue;
    for (const ByteRange range : rest_of({.offset = place, .bytes = declared.bytes}, owned)) {
      writes.shared.push_back(range);
    }
  }
  return writes;
}

void Areas::make_views(std::size_t index) {
  if (!first_of(plan_.blocks[index]).has_image()) return;
  const auto users = users_of(index);
  for (const std::size_t task : users) make_view(index, task, users.size() == 1);
}

void Areas::make_view(std::size_t index, std::size_t task, bool sole) {
  Block& block = blocks_[index];
  const bool registers = !block.memory.bytes().empty() && !block.inputs && !block.outputs;
  if (first_of(plan_.blocks[index]).is_input()) {
    auto& view =
        registers ? inputs_.emplace_back(index, block.initial, block.memory.bytes()).view
                  : inputs_.emplace_back(index, block.initial, block.inputs ? &*block.inputs : nullptr).view;
    cycles_[task].add(view);
    tell_view(index, task, view.bytes());
  } else {
    OutputView::Writes writes = writes_of(index, task);
    writes.sole = sole && !registers;
    auto& view =
        registers ? outputs_.emplace_back(index, block.initial, std::move(writes), block.memory.bytes()).view
                  : outputs_.emplace_back(index, block.initial, std::move(writes), block.outputs.get()).view;
    cycles_[task].add(view);
    tell_view(index, task, view.bytes());
  }
}

void Areas::tell_view(std::size_t index, std::size_t task, std::byte* bytes) {
  for (const std::size_t number : plan_.blocks[index].areas) {
    const DeclaredArea& area = declared_[number];
    std::byte* const address = bytes + plan_.places[number].offset;
    for (const AreaUse& use : area.uses) {
      if (task_number(use.task) != task) continue;
      cycles_[task].set_address(number, address);
      if (use.address != nullptr) *use.address = address;
      if (area.uses.size() == 1 && area.address != nullptr) *area.address = address;
    }
  }
}

// Tasks that may change what is kept are seen to be within a cycle.
void Areas::count_cycles(std::span<const TaskConfig> tasks) {
  if (!keeper_) return;
  KeptMemory& memory = keeper_->memory();
  for (const KeptShare& share : shares_of_kept()) {
    std::vector<std::pair<std::size_t, std::size_t>> stretches;
    for (const std::size_t area : share.areas) {
      stretches.emplace_back(kept_.areas[kept_number(area)].offset, declared_[area].bytes);
    }
    memory.add_group({share.tasks.begin(), share.tasks.end()}, stretches);
    for (const std::size_t task : share.tasks) {
      cycles_[task].count_into(memory.counter(task), memory.groups().back(),
                               tasks[task].iec_priority > kLowestRealTimeIecPriority);
    }
  }
}

// Kept areas and the tasks that may change them, so that no two shares have a task in common.
std::vector<Areas::KeptShare> Areas::shares_of_kept() const {
  std::vector<KeptShare> shares;
  for (std::size_t area = 0; area < declared_.size(); ++area) {
    if (!declared_[area].is_kept()) continue;
    KeptShare share{.tasks = {}, .areas = {area}};
    for (const AreaUse& use : declared_[area].uses) share.tasks.insert(task_number(use.task));
    const auto common = [&](const KeptShare& other) {
      return std::ranges::any_of(other.tasks, [&](std::size_t task) { return share.tasks.contains(task); });
    };
    const auto [first, last] =
        std::ranges::partition(shares, [&](const auto& other) { return !common(other); });
    for (const KeptShare& other : std::ranges::subrange(first, last)) {
      share.tasks.insert(other.tasks.begin(), other.tasks.end());
      share.areas.insert(share.areas.end(), other.areas.begin(), other.areas.end());
    }
    shares.erase(first, last);
    shares.push_back(std::move(share));
  }
  return shares;
}

void Areas::wrap(std::span<TaskConfig> tasks) {
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    if (cycles_[i].empty()) continue;
    TaskCycle* const cycle = &cycles_[i];
    tasks[i].entry = [cycle, entry = std::move(tasks[i].entry)] { cycle->run(entry); };
    tasks[i].before_entry = [cycle] { cycle->begin(); };
    tasks[i].after_entry = [cycle] { cycle->end(); };
    tasks[i].between_cycles = [cycle] { return cycle->give_kept(); };
  }
}

}  // namespace plchost
