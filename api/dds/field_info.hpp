#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace plchost::dds {

/// The meaning of a value, by the last part of its member's name.
enum class Unit : std::uint8_t {
  none,
  duration,  ///< nanoseconds
  unix,      ///< CLOCK_REALTIME of the host, ns since 1970; 0: none
};

/// A member of a status topic. visit_fields(sample, visit), which the build makes from control.idl, calls
/// visit(FieldInfo, value) for each of them but epoch, ext and what has parts: values are numbers, texts
/// (string_view) and arrays of octets.
struct FieldInfo {
  std::string_view name;  ///< in control.idl
  std::string_view base;  ///< without its unit
  Unit unit = Unit::none;
  bool key = false;
  std::span<const std::string_view> words;  ///< for its codes, from 0; empty: it is no code
};

/// The word for a code. A newer host may know more: its number is shown.
[[nodiscard]] inline std::string word_for(std::span<const std::string_view> words, std::uint64_t code) {
  return code < words.size() ? std::string(words[code]) : std::to_string(code);
}

/// How plcctl lists a topic: `list NOUN`. No noun: it does not, or by words of its own.
struct Listing {
  const char* noun = "";
  const char* text = "";
};
template <class Sample>
inline constexpr Listing kListing{};

}  // namespace plchost::dds
