#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "instances/runtime/memory/retain_image.hpp"
#include "shm/base/names.hpp"

namespace plchost {

/// A RetainArea as it lies in the file and in the retain memory.
struct AreaRecord {
  FixedText<kMaxTaskName> name;
  std::array<char, 5> zero{};
  std::uint32_t flags = 0;
  std::uint32_t bytes = 0;
  std::uint64_t layout = 0;
  std::uint64_t offset = 0;
};
static_assert(sizeof(AreaRecord) == 80);

[[nodiscard]] inline AreaRecord record_of(const RetainArea& area) {
  return {.name = FixedText<kMaxTaskName>(area.name),
          .flags = area.flags,
          .bytes = area.bytes,
          .layout = area.layout,
          .offset = area.offset};
}

/// Nothing: its name has no end.
[[nodiscard]] inline std::optional<RetainArea> area_of(const AreaRecord& record) {
  if (record.name.bytes.back() != '\0') return std::nullopt;
  return RetainArea{.name = std::string(record.name.view()),
                    .flags = record.flags,
                    .bytes = record.bytes,
                    .layout = record.layout,
                    .offset = record.offset};
}

}  // namespace plchost
