#include "instances/adapters/plcopen/iso_duration.hpp"

#include <array>
#include <charconv>
#include <limits>

#include <fmt/format.h>

namespace plchost::plcopen {

namespace {

constexpr std::int64_t kSecond = 1'000'000'000;

struct Unit {
  char letter;
  bool of_day;  // behind the T
  std::int64_t nanoseconds;
};
constexpr std::array<Unit, 4> kUnits{{{.letter = 'D', .of_day = false, .nanoseconds = 86'400 * kSecond},
                                      {.letter = 'H', .of_day = true, .nanoseconds = 3'600 * kSecond},
                                      {.letter = 'M', .of_day = true, .nanoseconds = 60 * kSecond},
                                      {.letter = 'S', .of_day = true, .nanoseconds = kSecond}}};

/// Takes "12" or "0.5" off, as parts of `unit`.
std::optional<std::int64_t> take_number(std::string_view& text, std::int64_t unit) {
  std::int64_t whole = 0;
  const auto read = std::from_chars(text.data(), text.data() + text.size(), whole);
  if (read.ec != std::errc() || whole < 0 || whole > std::numeric_limits<std::int64_t>::max() / unit - 1)
    return std::nullopt;
  text.remove_prefix(static_cast<std::size_t>(read.ptr - text.data()));
  std::int64_t result = whole * unit;
  if (!text.starts_with('.') && !text.starts_with(',')) return result;
  text.remove_prefix(1);
  for (; !text.empty() && text.front() >= '0' && text.front() <= '9'; text.remove_prefix(1)) {
    unit /= 10;
    result += (text.front() - '0') * unit;
  }
  return result;
}

}  // namespace

std::optional<std::int64_t> iso_nanoseconds(std::string_view text) {
  if (!text.starts_with('P') || text.size() < 3) return std::nullopt;
  text.remove_prefix(1);
  bool of_day = false;
  std::int64_t sum = 0;
  const Unit* next = kUnits.data();
  const Unit* const end = next + kUnits.size();
  while (!text.empty()) {
    if (text.front() == 'T' && !of_day && text.size() > 1) {
      of_day = true;
      text.remove_prefix(1);
    }
    // The letter decides the unit, so the number is read twice.
    std::string_view rest = text;
    if (!take_number(rest, 1) || rest.empty()) return std::nullopt;
    while (next != end && (next->letter != rest.front() || next->of_day != of_day)) ++next;
    if (next == end) return std::nullopt;
    const auto part = take_number(text, next->nanoseconds);
    if (!part || *part > std::numeric_limits<std::int64_t>::max() - sum) return std::nullopt;
    sum += *part;
    text.remove_prefix(1);
    ++next;
  }
  return sum;
}

std::string time_literal(std::int64_t nanoseconds) {
  if (nanoseconds % 1'000'000 == 0) return fmt::format("T#{}ms", nanoseconds / 1'000'000);
  if (nanoseconds % 1'000 == 0) return fmt::format("T#{}us", nanoseconds / 1'000);
  return fmt::format("T#{}ns", nanoseconds);
}

}  // namespace plchost::plcopen
