// How Areas puts outputs into their safe state, and what it leaves for the case that it cannot.

#include <algorithm>
#include <utility>

#include "instances/runtime/memory/areas.hpp"

namespace plchost {

namespace {

// Of a stretch of a device.
std::vector<std::byte> part_of(const std::vector<std::byte>& values, ByteRange range) {
  const auto begin = values.begin() + static_cast<std::ptrdiff_t>(range.offset);
  return {begin, begin + static_cast<std::ptrdiff_t>(range.bytes)};
}

}  // namespace

std::vector<std::byte> safe_values(const AreaSettings& settings) {
  if (settings.safe == SafeState::zero) return std::vector<std::byte>(settings.size);
  return settings.safe_values;
}

// Of each area one range, in the order of the plan.
std::vector<ByteRange> Areas::ranges_of(const AreaBlock& planned) const {
  std::vector<ByteRange> ranges;
  for (const std::size_t area : planned.areas)
    ranges.push_back({.offset = plan_.places[area].offset, .bytes = declared_[area].bytes});
  return ranges;
}

// Before anything is shown to a terminal: from then on another process can end it.
Result<void> Areas::make_outputs_page(const Environment& environment) {
  std::vector<LeftOutputs> left;
  for (const AreaBlock& planned : plan_.blocks) {
    if (planned.settings == nullptr || !first_of(planned).is_output()) continue;
    const AreaSettings& settings = *planned.settings;
    if (!settings.object.empty()) {
      left.push_back({.object = settings.object, .device = {}, .values = {}});
      continue;
    }
    const auto values = safe_values(settings);
    if (values.empty()) continue;
    for (const ByteRange range : ranges_of(planned)) {
      left.push_back({.object = {},
                      .device = settings.device,
                      .address = settings.address + range.offset,
                      .values = part_of(values, range)});
    }
  }
  if (left.empty()) return {};
  PLCHOST_TRY_ASSIGN(
      outputs_page_,
      in_step("page of outputs", OutputsPage::create(environment.pool->name(), environment.instance, left)));
  return {};
}

void Areas::make_registers(Block& block, const AreaBlock& planned) {
  const bool of_device = planned.settings != nullptr && planned.settings->object.empty();
  if (!of_device || !first_of(planned).is_output()) return;
  block.registers = std::make_unique<OutputRegisters>(block.memory.bytes(), ranges_of(planned), block.initial,
                                                      safe_values(*planned.settings));
  block.registers->put_safe();
}

// The ranges that are its own, and areas that no other task uses.
std::vector<ByteRange> Areas::written_alone(std::size_t index, std::size_t task) const {
  std::vector<ByteRange> alone;
  for (const std::size_t area : plan_.blocks[index].areas) {
    const DeclaredArea& declared = declared_[area];
    const std::size_t place = plan_.places[area].offset;
    for (const AreaUse& use : declared.uses) {
      if (task_number(use.task) != task) continue;
      if (declared.uses.size() == 1) {
        alone.push_back({.offset = place, .bytes = declared.bytes});
      } else if (use.bytes > 0) {
        alone.push_back({.offset = place + use.offset, .bytes = use.bytes});
      }
    }
  }
  return alone;
}

void Areas::make_safe_outputs() {
  std::vector<SafeOutputs::Block> blocks;
  for (std::size_t index = 0; index < blocks_.size(); ++index) {
    if (plan_.blocks[index].settings == nullptr) continue;
    SafeOutputs::Block block{.image = blocks_[index].outputs.get(),
                             .registers = blocks_[index].registers.get()};
    if (block.image == nullptr && block.registers == nullptr) continue;
    for (std::size_t i = 0; i < outputs_.size(); ++i) {
      if (outputs_[i].block != index) continue;
      block.writers.push_back({.task = output_tasks_[i],
                               .view = &outputs_[i].view,
                               .alone = written_alone(index, output_tasks_[i])});
    }
    blocks.push_back(std::move(block));
  }
  safe_outputs_->make(std::move(blocks), tasks_.size());
}

void Areas::end_outputs(bool settled) noexcept {
  safe_outputs_->put_safe(PLC_IMAGE_STATE_ENDED);
  if (!outputs_page_) return;
  if (!settled) outputs_page_->leave();
  outputs_page_.reset();
}

}  // namespace plchost
