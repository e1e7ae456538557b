#pragma once

#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <ranges>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "api/dds/sequence.hpp"
#include "shm/base/names.hpp"

namespace plchost {

// From members of samples to those of the library's types: for library_conversions.hpp, which the build
// makes.

/// The parts of "a,b" between the commas, or whatever `separator` is.
[[nodiscard]] inline std::vector<std::string> list_in(std::string_view text, char separator) {
  std::vector<std::string> words;
  for (const auto word : std::views::split(text, separator))
    words.push_back(printable_lines(std::string_view(word)));
  return words;
}

[[nodiscard]] inline std::chrono::system_clock::time_point wall_time(std::int64_t unix_ns) {
  return std::chrono::system_clock::time_point(
      std::chrono::duration_cast<std::chrono::system_clock::duration>(std::chrono::nanoseconds(unix_ns)));
}

template <std::size_t N>
[[nodiscard]] std::array<std::chrono::nanoseconds, N> durations(const std::array<std::int64_t, N>& from) {
  std::array<std::chrono::nanoseconds, N> made{};
  std::ranges::transform(from, made.begin(), [](std::int64_t ns) { return std::chrono::nanoseconds(ns); });
  return made;
}

template <std::size_t N>
[[nodiscard]] std::string hex_text(const std::array<std::uint8_t, N>& octets) {
  return fmt::format("{:02x}", fmt::join(octets, ""));
}

/// The parts of a sequence, each as `convert(part)`.
template <class Sequence, class Convert>
[[nodiscard]] auto all_public(const Sequence& sequence, Convert convert) {
  std::vector<decltype(convert(*sequence._buffer))> made;
  std::ranges::transform(dds::parts_of(sequence), std::back_inserter(made), convert);
  return made;
}

}  // namespace plchost
