#include "instances/runtime/memory/declared_area.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "shm/base/names.hpp"
#include "shm/plc_process_image.h"

namespace plchost {

static_assert(PLC_MAX_IMAGE == PLC_IMAGE_MAX_SIZE);
// Each task that writes holds one slot at most; the latest and one that ages are beside them.
static_assert(PLC_MAX_AREA_USES + 2 == PLC_IMAGE_SLOTS);

namespace {

std::unexpected<Error> bad_area(std::string_view name, std::string_view what) {
  return failure(ErrorCode::invalid_argument, fmt::format("area '{}': {}", shown(name), what));
}

Result<void> check_flags(const DeclaredArea& area) {
  constexpr std::uint32_t kKinds = PLC_AREA_DATA | PLC_AREA_CONSTANT | PLC_AREA_INPUT | PLC_AREA_OUTPUT |
                                   PLC_AREA_MEMORY | PLC_AREA_RETAIN | PLC_AREA_CODE | PLC_AREA_PERSISTENT;
  if ((area.flags & ~(kKinds | PLC_AREA_USER)) != 0 || area.flags == 0) {
    return bad_area(area.name, fmt::format("dwFlags {:#x} are not allowed: bits of {:#x} are", area.flags,
                                           kKinds | PLC_AREA_USER));
  }
  if (area.is_input() && area.is_output()) return bad_area(area.name, "is input or output, not both");
  if (area.has_image() && area.is_retain()) {
    return bad_area(area.name,
                    "inputs and outputs have no retain values: RETAIN and PERSISTENT are for other areas");
  }
  return {};
}

Result<void> check_size(const DeclaredArea& area) {
  const std::uint32_t most = area.has_image()   ? PLC_MAX_IMAGE
                             : area.is_retain() ? PLC_MAX_RETAIN
                                                : static_cast<std::uint32_t>(1) << 30U;
  if (area.bytes >= 1 && area.bytes <= most) return {};
  return bad_area(area.name, fmt::format("dwBytes {} is not allowed: 1 to {} is", area.bytes, most));
}

Result<AreaUse> from_use(const DeclaredArea& area, const Plc_Area_Use& use) {
  if (use.pszTask == nullptr) return bad_area(area.name, "pszTask of a use is null");
  AreaUse taken{.task = std::string(cut(use.pszTask, kMaxTaskName + 1)),
                .offset = use.dwOffset,
                .bytes = use.dwBytes,
                .address = use.ppAddress};
  if (use.dwBytes != 0 && !area.is_output()) {
    return bad_area(area.name, fmt::format("task '{}': dwBytes is for outputs", shown(taken.task)));
  }
  if (taken.offset > area.bytes || taken.bytes > area.bytes - taken.offset) {
    return bad_area(area.name,
                    fmt::format("task '{}': bytes {} to {} are not in it, it has {}", shown(taken.task),
                                taken.offset, std::uint64_t{taken.offset} + taken.bytes, area.bytes));
  }
  if (use.ppAddress != nullptr) *use.ppAddress = nullptr;
  return taken;
}

bool overlap(const AreaUse& a, const AreaUse& b) {
  return a.bytes != 0 && b.bytes != 0 && a.offset < b.offset + b.bytes && b.offset < a.offset + a.bytes;
}

// Of a task that is used twice, or of bytes that two tasks write.
Result<void> check_pairs(const DeclaredArea& area) {
  for (auto use = area.uses.begin(); use != area.uses.end(); ++use) {
    for (auto other = area.uses.begin(); other != use; ++other) {
      if (use->task == other->task) {
        return bad_area(area.name, fmt::format("task '{}' is named twice", use->task));
      }
      if (overlap(*use, *other)) {
        return bad_area(area.name,
                        fmt::format("tasks '{}' and '{}' write the same bytes", other->task, use->task));
      }
    }
  }
  return {};
}

Result<void> complete(DeclaredArea& area, std::span<const std::string> tasks) {
  if (area.uses.empty()) {
    for (const std::string& task : tasks) area.uses.push_back({.task = task});
    if (area.is_output() && tasks.size() == 1) area.uses.front().bytes = area.bytes;
  }
  for (const AreaUse& use : area.uses) {
    if (std::ranges::find(tasks, use.task) != tasks.end()) continue;
    const std::vector<std::string_view> names(tasks.begin(), tasks.end());
    return bad_area(area.name, fmt::format("the application has no task '{}'; its tasks are {}",
                                           shown(use.task), join_names(names)));
  }
  if (area.has_image() && area.uses.size() > PLC_MAX_AREA_USES) {
    return bad_area(area.name, fmt::format("{} tasks use it; at most {} can: name them in pUses",
                                           area.uses.size(), PLC_MAX_AREA_USES));
  }
  return check_pairs(area);
}

}  // namespace

Result<DeclaredArea> from_declaration(const Plc_Area& area) {
  const std::string_view name = area.pszName == nullptr ? std::string_view() : area.pszName;
  if (area.dwSize != sizeof(Plc_Area)) {
    return bad_area(name, fmt::format("dwSize is {}, sizeof(Plc_Area) is {}", area.dwSize, sizeof(Plc_Area)));
  }
  PLCHOST_TRY(check_name("area", name, PLC_MAX_AREA_NAME));
  DeclaredArea taken{.name = std::string(name),
                     .flags = area.dwFlags,
                     .bytes = area.dwBytes,
                     .layout = area.qwLayout,
                     .uses = {},
                     .initial = {},
                     .address = area.ppAddress};
  PLCHOST_TRY(check_flags(taken));
  PLCHOST_TRY(check_size(taken));
  if (area.nUses > PLC_MAX_TASKS || (area.nUses > 0 && area.pUses == nullptr)) {
    return bad_area(
        name, fmt::format("nUses is {}, pUses must point to as many, at most {}", area.nUses, PLC_MAX_TASKS));
  }
  for (unsigned i = 0; i < area.nUses; ++i) {
    PLCHOST_TRY_ASSIGN(auto use, from_use(taken, area.pUses[i]));
    taken.uses.push_back(std::move(use));
  }
  taken.initial.assign(area.dwBytes, std::byte{0});
  if (area.pInitial != nullptr) {
    std::copy_n(static_cast<const std::byte*>(area.pInitial), area.dwBytes, taken.initial.begin());
  }
  if (taken.address != nullptr) *taken.address = nullptr;
  return taken;
}

Result<void> complete_uses(std::vector<DeclaredArea>& areas, std::span<const std::string> tasks) {
  for (DeclaredArea& area : areas) {
    if (auto done = complete(area, tasks); !done) return done;
  }
  return {};
}

}  // namespace plchost
