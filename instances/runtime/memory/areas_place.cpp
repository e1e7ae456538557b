// How Areas places what the application declared: once, before its tasks are made.

#include <algorithm>
#include <numeric>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "instances/launch/launch_contract.hpp"
#include "instances/runtime/memory/areas.hpp"
#include "instances/runtime/memory/silence.hpp"

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

// Where the next retain area lies behind one that ends at `bytes`.
std::size_t behind_retain(std::size_t bytes) noexcept {
  return (bytes + kRetainAlignment - 1) / kRetainAlignment * kRetainAlignment;
}

Result<void> check_retain_bytes(std::uint64_t bytes) {
  if (bytes <= kMaxRetainBytes) return {};
  return failure(
      ErrorCode::invalid_argument,
      fmt::format("the retain and persistent areas have {} bytes, {} are allowed", bytes, kMaxRetainBytes));
}

std::string name_of(const AreaSettings& settings) {
  return fmt::format("{}: [SysMem] Area.{}", settings.where, settings.number);
}

std::size_t bytes_in_pool(const AreaSettings& settings, const DeclaredArea& first) {
  return first.has_image() ? plc_image_bytes(static_cast<std::uint32_t>(settings.size)) : settings.size;
}

// All retain areas, with their initial values.
RetainImage retain_image(const std::string& application, std::span<const DeclaredArea> areas) {
  RetainImage image;
  image.layout.application = application;
  for (const DeclaredArea& area : areas) {
    if (!area.is_retain()) continue;
    image.layout.areas.push_back({.name = area.name,
                                  .flags = area.flags & (PLC_AREA_RETAIN | PLC_AREA_PERSISTENT),
                                  .bytes = area.bytes,
                                  .layout = area.layout,
                                  .offset = image.data.size()});
    image.data.insert(image.data.end(), area.initial.begin(), area.initial.end());
    image.data.resize(behind_retain(image.data.size()));
  }
  image.layout.bytes = image.data.size();
  return image;
}

// After an update of the host its kept images are those of the header before.
Error not_this_memory(Error error, const DeclaredArea& first) {
  if (error.code == ErrorCode::wrong_size && first.has_image()) {
    error.message += fmt::format(
        "; if Size is right, it is an image of a plc_process_image.h before version {}: remove it while no "
        "program uses it, and compile its firmware anew",
        PLC_IMAGE_VERSION);
  }
  return error;
}

Result<void> check_memory(const Areas::Environment& environment, const AreaSettings& settings,
                          const DeclaredArea& first) {
  if (settings.object.empty()) return AreaMemory::check_device(settings);
  if (environment.pool == nullptr) return {};
  const std::size_t bytes = bytes_in_pool(settings, first);
  const auto there = AreaMemory::check_pool(*environment.pool, settings.object, bytes);
  if (!there) return failure_in(name_of(settings), not_this_memory(there.error(), first));
  if (*there || environment.room == nullptr) return {};
  return in_step(name_of(settings), environment.room->take_memory(settings.object, bytes));
}

// The old memory goes only when the new one is whole, so both need their bytes.
Result<void> check_retain(const Areas::Environment& environment, const RetainImage& retain) {
  const std::string pool = environment.pool == nullptr ? std::string() : environment.pool->name();
  PLCHOST_TRY_ASSIGN(const auto fresh,
                     RetainKeeper::check(pool, environment.instance, retain, environment.retain));
  if (fresh == 0 || environment.room == nullptr) return {};
  return in_step("retain variables",
                 environment.room->take_memory(retain_memory_name(environment.instance), fresh));
}

// The settings are checked by their texts. But a file has many: symbolic and hard links, and that of a memory
// of the pool, one of which holds the retain areas.
Result<void> check_distinct(const Areas::Environment& environment, const AreaPlan& plan,
                            std::span<const DeclaredArea> areas) {
  struct Taken {
    std::string by;
    FileRange range;
  };
  if (environment.pool == nullptr) return {};
  const std::string& pool = environment.pool->name();
  std::vector<Taken> taken;
  const std::string retain = retain_memory_name(environment.instance);
  if (const auto range = range_of_memory(pool, retain);
      range && std::ranges::any_of(areas, &DeclaredArea::is_retain)) {
    taken.push_back(
        {.by = fmt::format("the retain variables of the instance, memory '{}' of the pool", retain),
         .range = *range});
  }
  std::set<const AreaSettings*> seen;  // a setting has a block for each kind of area
  for (const AreaBlock& block : plan.blocks) {
    const AreaSettings* const settings = block.settings;
    if (settings == nullptr || !seen.insert(settings).second) continue;
    const bool device = settings->object.empty();
    const auto range = device ? range_of_device(*settings) : range_of_memory(pool, settings->object);
    if (!range) continue;
    if (const auto own = own_file_of_pool(pool, *range)) {
      return failure(ErrorCode::invalid_argument,
                     fmt::format("{}: {} is {}, in which the host manages its pool; choose another file, or "
                                 "Object=NAME for a memory of the pool",
                                 name_of(*settings), settings->device, *own));
    }
    for (const Taken& other : taken) {
      if (!range->overlaps(other.range)) continue;
      return failure(
          ErrorCode::invalid_argument,
          fmt::format("{}: {} is the same file as that of {}, and they overlap; each needs bytes of "
                      "its own",
                      name_of(*settings), device ? settings->device : settings->object, other.by));
    }
    taken.push_back({.by = fmt::format("Area.{} of {}", settings->number, settings->where), .range = *range});
  }
  return {};
}

}  // namespace

Result<void> Areas::check(const Environment& environment, std::span<const DeclaredArea> areas) {
  if (areas.empty()) return {};
  PLCHOST_TRY_ASSIGN(const auto plan, plan_areas(areas, environment.settings));
  for (const AreaBlock& planned : plan.blocks) {
    if (planned.settings == nullptr) continue;
    if (auto good = check_memory(environment, *planned.settings, areas[planned.areas.front()]); !good)
      return good;
  }
  if (auto distinct = check_distinct(environment, plan, areas); !distinct) return distinct;
  const RetainImage retain = retain_image(environment.application, areas);
  if (retain.layout.areas.empty()) return {};
  if (auto good = check_retain_bytes(retain.layout.bytes); !good) return good;
  return check_retain(environment, retain);
}

Result<std::string> Areas::place(const Environment& environment, std::vector<DeclaredArea> areas,
                                 std::span<TaskConfig> tasks) {
  declared_ = std::move(areas);
  cycles_.resize(tasks.size());
  if (declared_.empty()) {
    wrap(tasks, environment.forces);
    placed_ = true;
    return std::string();
  }
  for (const TaskConfig& task : tasks) tasks_.push_back(task.name);
  PLCHOST_TRY_ASSIGN(plan_, plan_areas(declared_, environment.settings));
  plain_.resize(declared_.size(), nullptr);
  // All steps that can fail come before anything is written that others see.
  auto made = make_blocks(environment);
  if (made) made = make_keeper(environment);
  if (made) made = make_outputs_page(environment);
  if (!made) {
    blocks_.clear();  // with all that they have made in the pool
    return std::unexpected(std::move(made).error());
  }
  for (std::size_t i = 0; i < blocks_.size(); ++i) {
    if (!first_of(plan_.blocks[i]).has_image()) continue;
    make_image(blocks_[i], plan_.blocks[i]);
    make_registers(blocks_[i], plan_.blocks[i]);
  }
  tell_plain_addresses();
  for (std::size_t block = 0; block < plan_.blocks.size(); ++block) make_views(block);
  make_safe_outputs();
  count_cycles(tasks);
  wrap(tasks, environment.forces);
  placed_ = true;
  return keeper_ ? fmt::format("{}", fmt::join(keeper_->remarks(), "; ")) : std::string();
}

Result<void> Areas::keep() {
  if (keeper_) {
    if (auto started = keeper_->start(); !started) return started;
  }
  for (Block& block : blocks_) block.memory.keep();
  return {};
}

Result<void> Areas::make_blocks(const Environment& environment) {
  for (const AreaBlock& planned : plan_.blocks) {
    Block& block = blocks_.emplace_back();
    if (planned.settings == nullptr && first_of(planned).is_retain()) continue;  // RetainKeeper's
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
    PLCHOST_TRY_ASSIGN(block.memory, std::move(made));
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
  // An image says by its header that it is none yet.
  const std::span<const std::byte> contents =
      first.has_image() ? std::span<const std::byte>() : std::span<const std::byte>(block.initial);
  PLCHOST_TRY_ASSIGN(
      auto made, in_step(name_of(settings),
                         AreaMemory::of_pool(*environment.pool, settings.object,
                                             bytes_in_pool(settings, first), contents, first.is_output())));
  return take(std::move(made));
}

// Several areas of a block are one image: a task sees all of them as they were at one time.
void Areas::make_image(Block& block, const AreaBlock& planned) {
  const bool of_device = planned.settings != nullptr && planned.settings->object.empty();
  if (of_device || block.memory.bytes().empty()) return;
  const auto size =
      static_cast<std::uint32_t>(planned.settings != nullptr ? planned.bytes : first_of(planned).bytes);
  auto* const header = reinterpret_cast<plc_image_header*>(block.memory.bytes().data());
  // Made by firmware, it is one already; any other one that was there is none of theirs.
  if (plc_image_is_one(header, size) == 0) plc_image_begin(header, size);
  block.initial.resize(size);
  if (first_of(planned).is_input()) {
    block.inputs = image_in(block.memory.bytes(), size);
    tell_silence(*block.inputs);  // before the first cycle
  } else {
    block.outputs = std::make_unique<OutputImage>(block.memory.bytes(), size);
    if (planned.settings == nullptr) return block.outputs->write(block.initial);
    const AreaSettings& settings = *planned.settings;
    block.outputs->begin(block.initial, safe_values(settings), settings.safe != SafeState::unsaid);
  }
}

Result<void> Areas::make_keeper(const Environment& environment) {
  const RetainImage initial = retain_image(environment.application, declared_);
  if (initial.layout.areas.empty()) return {};
  retain_ = initial.layout;
  PLCHOST_TRY_ASSIGN(
      keeper_, RetainKeeper::make(*environment.pool, environment.instance, initial, environment.retain));
  return {};
}

void Areas::tell_plain_addresses() {
  for (std::size_t i = 0; i < declared_.size(); ++i) {
    const DeclaredArea& area = declared_[i];
    if (area.has_image()) continue;
    const AreaPlan::Place place = plan_.places[i];
    const AreaBlock& planned = plan_.blocks[place.block];
    const auto at_retain = [&] { return retain_.areas[retain_number(i)].offset; };
    if (area.is_retain() && planned.settings == nullptr) {
      plain_[i] = keeper_->memory().data().data() + at_retain();
    } else {
      const auto bytes = blocks_[place.block].memory.bytes().subspan(place.offset, area.bytes);
      plain_[i] = bytes.data();
      // Areas in a device or in the pool that are not retain may have been written by others: they stay.
      if (area.is_retain()) keeper_->memory().live_elsewhere(at_retain(), bytes);
      if (!area.is_retain() && !blocks_[place.block].memory.existed())
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

OutputView::Writes Areas::writes_of(std::size_t index, std::size_t task, bool image) const {
  OutputView::Writes writes;
  for (const std::size_t area : plan_.blocks[index].areas) {
    const DeclaredArea& declared = declared_[area];
    const auto place = static_cast<std::size_t>(plan_.places[area].offset);
    std::vector<ByteRange> owned;  // by any task
    bool uses = false;
    for (const AreaUse& use : declared.uses) {
      const ByteRange range{.offset = place + use.offset, .bytes = use.bytes};
      // In an image only this task's bytes are there, changed or not.
      const bool whole = image && declared.uses.size() == 1;
      const ByteRange owns = whole ? ByteRange{.offset = place, .bytes = declared.bytes} : range;
      if (owns.bytes > 0) owned.push_back(owns);
      if (task_number(use.task) != task) continue;
      uses = true;
      if (owns.bytes > 0) writes.own.push_back(owns);
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
    OutputView::Writes writes = writes_of(index, task, !registers);
    writes.sole = sole && !registers;
    output_tasks_.push_back(task);
    auto& view =
        registers ? outputs_.emplace_back(index, block.initial, std::move(writes), *block.registers).view
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

// Tasks that may change the retain areas are seen to be within a cycle.
void Areas::count_cycles(std::span<const TaskConfig> tasks) {
  if (!keeper_) return;
  RetainMemory& memory = keeper_->memory();
  for (const RetainShare& share : shares_of_retain()) {
    std::vector<std::pair<std::size_t, std::size_t>> stretches;
    for (const std::size_t area : share.areas) {
      stretches.emplace_back(retain_.areas[retain_number(area)].offset, declared_[area].bytes);
    }
    memory.add_group({share.tasks.begin(), share.tasks.end()}, stretches);
    for (const std::size_t task : share.tasks) {
      cycles_[task].count_into(memory.counter(task), memory.groups().back(),
                               tasks[task].iec_priority > kLowestRealTimeIecPriority);
    }
  }
}

// Retain areas and the tasks that may change them, so that no two shares have a task in common.
std::vector<Areas::RetainShare> Areas::shares_of_retain() const {
  std::vector<RetainShare> shares;
  for (std::size_t area = 0; area < declared_.size(); ++area) {
    if (!declared_[area].is_retain()) continue;
    RetainShare share{.tasks = {}, .areas = {area}};
    for (const AreaUse& use : declared_[area].uses) share.tasks.insert(task_number(use.task));
    const auto common = [&](const RetainShare& other) {
      return std::ranges::any_of(other.tasks, [&](std::size_t task) { return share.tasks.contains(task); });
    };
    const auto [first, last] =
        std::ranges::partition(shares, [&](const auto& other) { return !common(other); });
    for (const RetainShare& other : std::ranges::subrange(first, last)) {
      share.tasks.insert(other.tasks.begin(), other.tasks.end());
      share.areas.insert(share.areas.end(), other.areas.begin(), other.areas.end());
    }
    shares.erase(first, last);
    shares.push_back(std::move(share));
  }
  return shares;
}

void Areas::wrap(std::span<TaskConfig> tasks, std::span<const ForceSlot> forces) {
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    TaskCycle* const cycle = &cycles_[i];
    const bool has_areas = !cycle->empty();
    if (!forces.empty()) cycle->use_forces(forces[i]);
    if (cycle->empty()) continue;
    tasks[i].entry = [cycle, entry = std::move(tasks[i].entry)] { cycle->run(entry); };
    if (!has_areas) continue;
    tasks[i].before_entry = [cycle] { cycle->begin(); };
    tasks[i].after_entry = [cycle] { cycle->end(); };
    tasks[i].between_cycles = [cycle] { return cycle->give_retain(); };
  }
}

}  // namespace plchost
