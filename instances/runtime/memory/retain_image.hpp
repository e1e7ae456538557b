#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "shm/base/result.hpp"

namespace plchost {

/// A retain area within a RetainImage.
struct RetainArea {
  std::string name;
  std::uint32_t flags = 0;
  std::uint32_t bytes = 0;
  std::uint64_t layout = 0;  ///< as the application gave it
  std::uint64_t offset = 0;  ///< in the data
  bool operator==(const RetainArea&) const = default;
};

inline constexpr std::size_t kMaxRetainAreas = 64;
inline constexpr std::size_t kMaxRetainBytes = std::size_t{1} << 24;
/// Of each area's offset.
inline constexpr std::size_t kRetainAlignment = 8;

/// The layout: which bytes belong to which variables. Two are equal exactly if values kept by the one are the
/// other's.
struct RetainLayout {
  std::string application;
  std::vector<RetainArea> areas;
  std::uint64_t bytes = 0;  ///< of the data: all areas and what lies between them
  bool operator==(const RetainLayout&) const = default;
};

/// corrupt: an area lies outside of the data or over another, or a bound is not held.
[[nodiscard]] Result<void> check_layout(const RetainLayout& layout);

/// The retain variables of one application at the end of a cycle.
struct RetainImage {
  std::uint64_t generation = 0;  ///< counts up with each that is written
  std::int64_t unix_ns = 0;      ///< when it was taken
  RetainLayout layout;
  std::vector<std::byte> data;
  bool operator==(const RetainImage&) const = default;
};

/// The contents of a file, with a checksum over all of it (CRC-64/XZ).
[[nodiscard]] std::string encode(const RetainImage& image);
/// corrupt: cut, changed, or something else. Any bytes are either a whole image or refused.
[[nodiscard]] Result<RetainImage> decode_retain(std::string_view file);

/// CRC-64/XZ.
[[nodiscard]] std::uint64_t crc64(std::span<const std::byte> bytes) noexcept;

}  // namespace plchost
