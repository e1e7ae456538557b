#include "instances/runtime/memory/area_plan.hpp"

#include <algorithm>
#include <optional>
#include <utility>

#include <fmt/format.h>

namespace plchost {

namespace {

std::uint64_t aligned(std::uint64_t bytes) {
  return (bytes + kAreaAlignment - 1) / kAreaAlignment * kAreaAlignment;
}

enum class Content : std::uint8_t { input, output, plain };

Content content_of(const DeclaredArea& area) {
  return area.is_input() ? Content::input : area.is_output() ? Content::output : Content::plain;
}

std::unexpected<Error> refused(const AreaSettings& settings, std::string_view area, std::string_view what) {
  return failure(ErrorCode::invalid_argument,
                 fmt::format("{}: [SysMem] Area.{}: area '{}' of the application {}", settings.where,
                             settings.number, area, what));
}

class Planner {
 public:
  explicit Planner(std::span<const DeclaredArea> areas) : areas_(areas) {}

  Result<void> put_into(const AreaSettings& settings, std::size_t area) {
    const std::uint64_t offset = end_of(settings);
    if (auto fits = check(settings, offset, area); !fits) return fits;
    const auto found = std::ranges::find_if(plan.blocks, [&](const AreaBlock& block) {
      return block.settings == &settings &&
             content_of(areas_[block.areas.front()]) == content_of(areas_[area]);
    });
    const std::size_t block = found == plan.blocks.end()
                                  ? add({.settings = &settings, .bytes = settings.size, .areas = {}})
                                  : static_cast<std::size_t>(found - plan.blocks.begin());
    put(block, offset, area);
    return {};
  }

  // Areas that the runtime keeps lie together: they are written together.
  void put_anywhere(std::size_t area) {
    const bool retain = areas_[area].is_retain();
    if (!retain || !retain_) {
      const std::size_t block = add({});
      if (retain) retain_ = block;
      put(block, 0, area);
    } else {
      put(*retain_, end_of(plan.blocks[*retain_]), area);
    }
    AreaBlock& block = plan.blocks[plan.places[area].block];
    block.bytes = aligned(plan.places[area].offset + areas_[area].bytes);
  }

  AreaPlan plan;

 private:
  Result<void> check(const AreaSettings& settings, std::uint64_t offset, std::size_t area) const {
    const DeclaredArea& wanted = areas_[area];
    const std::uint64_t left = offset > settings.size ? 0 : settings.size - offset;
    if (wanted.bytes > left) {
      return refused(settings, wanted.name,
                     fmt::format("has {} bytes, {} of the {} are left; enlarge Size, or have "
                                 "an area before it match its flags {:#06x}",
                                 wanted.bytes, left, settings.size, wanted.flags));
    }
    if (settings.object.empty()) return {};
    if (changes_outputs(settings.safe) && !wanted.is_output()) {
      return refused(settings, wanted.name,
                     "is no output, but the Object has a SafeState, which is for outputs");
    }
    const auto first = std::ranges::find(plan.blocks, &settings, &AreaBlock::settings);
    const DeclaredArea* const other = first == plan.blocks.end() ? nullptr : &areas_[first->areas.front()];
    if (other != nullptr && content_of(*other) != content_of(wanted)) {
      return refused(
          settings, wanted.name,
          fmt::format("cannot lie in one Object with '{}': one holds inputs, or outputs, or others",
                      other->name));
    }
    if (wanted.has_image() && settings.size > PLC_MAX_IMAGE) {
      return refused(
          settings, wanted.name,
          fmt::format("is an input or output, whose Object has a Size of at most {}", PLC_MAX_IMAGE));
    }
    return {};
  }

  [[nodiscard]] std::uint64_t end_of(const AreaBlock& block) const {
    if (block.areas.empty()) return 0;
    const std::size_t last = block.areas.back();
    return aligned(plan.places[last].offset + areas_[last].bytes);
  }

  // Behind all areas that lie there.
  [[nodiscard]] std::uint64_t end_of(const AreaSettings& settings) const {
    std::uint64_t end = 0;
    for (const AreaBlock& block : plan.blocks) {
      if (block.settings == &settings) end = std::max(end, end_of(block));
    }
    return end;
  }

  std::size_t add(AreaBlock block) {
    plan.blocks.push_back(std::move(block));
    return plan.blocks.size() - 1;
  }

  void put(std::size_t block, std::uint64_t offset, std::size_t area) {
    plan.blocks[block].areas.push_back(area);
    plan.places.push_back({.block = block, .offset = offset});
  }

  std::span<const DeclaredArea> areas_;
  std::optional<std::size_t> retain_;
};

}  // namespace

bool flags_match(std::uint32_t declared, std::uint32_t configured) noexcept {
  const std::uint32_t user = declared & PLC_AREA_USER;
  const std::uint32_t asked = user != 0 ? user : declared;
  return (asked & configured) == asked;
}

Result<AreaPlan> plan_areas(std::span<const DeclaredArea> areas, std::span<const AreaSettings> settings) {
  Planner planner(areas);
  for (std::size_t area = 0; area < areas.size(); ++area) {
    const auto match = std::ranges::find_if(
        settings, [&](const AreaSettings& one) { return flags_match(areas[area].flags, one.flags); });
    if (match == settings.end()) {
      planner.put_anywhere(area);
    } else {
      PLCHOST_TRY(planner.put_into(*match, area));
    }
  }
  return std::move(planner.plan);
}

}  // namespace plchost
