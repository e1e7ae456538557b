#include "instances/runtime/memory/areas.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "instances/runtime/memory/silence.hpp"
#include "shm/log/log.hpp"

namespace plchost {

namespace {

// Handles are numbers from 1 on.
RTS_HANDLE handle_of(std::size_t area) noexcept {
  // NOLINTNEXTLINE(performance-no-int-to-ptr): a number that looks like a handle
  return reinterpret_cast<RTS_HANDLE>(area + 1);
}
std::size_t number_of(RTS_HANDLE handle) noexcept {
  return reinterpret_cast<std::uintptr_t>(handle) - 1;
}

RTS_RESULT refuse_area(RTS_RESULT why, std::string_view text) {
  spdlog::error("plc_declare_area: {}", text);
  return why;
}

RTS_RESULT add_area(std::vector<DeclaredArea>& areas, const Plc_Area* area) {
  if (area == nullptr) return refuse_area(ERR_PARAMETER, "pArea is null");
  auto taken = from_declaration(*area);
  if (!taken) return refuse_area(ERR_PARAMETER, taken.error().message);
  if (std::ranges::find(areas, taken->name, &DeclaredArea::name) != areas.end()) {
    return refuse_area(ERR_DUPLICATE, fmt::format("area '{}' is declared twice", taken->name));
  }
  if (areas.size() == PLC_MAX_AREAS) {
    return refuse_area(ERR_NOMEMORY,
                       fmt::format("area '{}' is one too many: {} can be", taken->name, PLC_MAX_AREAS));
  }
  areas.push_back(*std::move(taken));
  return ERR_OK;
}

}  // namespace

RTS_HANDLE Areas::declare(std::vector<DeclaredArea>& areas, const Plc_Area* area, RTS_RESULT& result) const {
  result = add_area(areas, area);
  if (result != ERR_OK) return RTS_INVALID_HANDLE;
  if (!placed_) return handle_of(areas.size() - 1);
  const auto known = std::ranges::find(declared_, areas.back().name, &DeclaredArea::name);
  return handle_of(static_cast<std::size_t>(known - declared_.begin()));
}

void Areas::tell_addresses(const std::vector<DeclaredArea>& areas) const {
  for (const DeclaredArea& area : areas) {
    const auto known = std::ranges::find(declared_, area.name, &DeclaredArea::name);
    if (!placed_ || known == declared_.end()) continue;
    const auto number = static_cast<std::size_t>(known - declared_.begin());
    for (const AreaUse& use : area.uses) {
      void* const address =
          area.has_image() ? cycles_[task_number(use.task)].address(number) : plain_[number];
      if (use.address != nullptr) *use.address = address;
      if ((!area.has_image() || area.uses.size() == 1) && area.address != nullptr) *area.address = address;
    }
  }
}

void* Areas::address(RTS_HANDLE area) const noexcept {
  const std::size_t number = number_of(area);
  if (!placed_ || number >= declared_.size()) return nullptr;
  if (!declared_[number].has_image()) return plain_[number];
  const TaskCycle* const cycle = TaskCycle::here();
  return cycle == nullptr ? nullptr : cycle->address(number);
}

std::size_t Areas::retain_number(std::size_t area) const noexcept {
  return static_cast<std::size_t>(std::ranges::count_if(
      std::span(declared_).first(area), [](const DeclaredArea& one) { return one.is_retain(); }));
}

std::vector<std::string> Areas::look_for_losses() {
  std::vector<std::string> losses;
  for (Block& block : blocks_) {
    if (!block.memory.lost() || std::exchange(block.loss_told, true)) continue;
    losses.push_back(
        fmt::format("{} was cut short by another program: only this instance sees the values in these areas, "
                    "and they are gone when it ends. Give it its size again, and restart the instance",
                    block.source));
  }
  return losses;
}

// The next image of the firmware ends it, also if it was only late.
std::vector<std::string> Areas::watch_inputs() {
  std::vector<std::string> news;
  for (Block& block : blocks_) {
    if (!block.inputs) continue;
    tell_silence(*block.inputs);
    const bool silent = plc_image_state(&*block.inputs) == PLC_IMAGE_STATE_SILENT;
    if (std::exchange(block.inputs_silent, silent) == silent) continue;
    news.push_back(
        fmt::format("{}: {}", block.source,
                    silent ? "the firmware of these inputs has ended or stands still; they are what it has "
                             "left for that"
                           : "the firmware of these inputs writes them again"));
  }
  return news;
}

RTS_RESULT Areas::state(RTS_HANDLE area, Plc_Area_State& state) const noexcept {
  const std::size_t number = number_of(area);
  if (!placed_) return ERR_NOTINITIALIZED;
  if (number >= declared_.size() || state.dwSize != sizeof(Plc_Area_State)) return ERR_PARAMETER;
  state = {};
  state.dwSize = sizeof(Plc_Area_State);
  const DeclaredArea& declared = declared_[number];
  const std::size_t block = plan_.places[number].block;
  const auto add = [&](const auto& views) {
    for (const auto& view : views) {
      if (view.block != block) continue;
      state.qwImages = view.view.images();
      state.qwMissed += view.view.missed();
    }
  };
  add(inputs_);
  add(outputs_);
  if (declared.is_retain() && keeper_) {
    state.dwOrigin = keeper_->origin(retain_number(number));
    state.qwSaves = keeper_->saves();
    state.qwUnsaved = keeper_->unsaved();
  }
  return ERR_OK;
}

}  // namespace plchost
