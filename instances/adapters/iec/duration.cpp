#include "instances/adapters/iec/duration.hpp"

#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include <fmt/format.h>

#include "instances/adapters/iec/tokens.hpp"

namespace plchost::iec {

namespace {

struct Unit {
  std::string_view name;
  std::int64_t nanoseconds;
};
// From the largest to the smallest: the order in which a literal has them. "ms" stands before "m".
constexpr std::int64_t kSecond = 1'000'000'000;
constexpr std::array<Unit, 7> kUnits{{{"D", 86'400 * kSecond},
                                      {"H", 3'600 * kSecond},
                                      {"MS", 1'000'000},
                                      {"M", 60 * kSecond},
                                      {"S", kSecond},
                                      {"US", 1'000},
                                      {"NS", 1}}};
constexpr std::int64_t kMost = std::numeric_limits<std::int64_t>::max();

/// Digits before and behind the point; false: there is none.
bool take_number(std::string_view& text, std::int64_t& whole, std::int64_t& parts, std::int64_t& scale) {
  bool any = false;
  bool fraction = false;
  whole = parts = 0;
  scale = 1;
  while (!text.empty()) {
    const char c = text.front();
    if (c == '.' && any && !fraction) {
      fraction = true;
    } else if (c >= '0' && c <= '9') {
      any = true;
      std::int64_t& value = fraction ? parts : whole;
      if (value > (kMost - 9) / 10 || (fraction && scale > kMost / 10)) return false;
      value = value * 10 + (c - '0');
      if (fraction) scale *= 10;
    } else if (c != '_') {
      break;
    }
    text.remove_prefix(1);
  }
  return any;
}

std::optional<Unit> take_unit(std::string_view& text) {
  for (const Unit& unit : kUnits) {
    if (!text.starts_with(unit.name)) continue;
    text.remove_prefix(unit.name.size());
    return unit;
  }
  return std::nullopt;
}

}  // namespace

std::expected<std::int64_t, std::string> nanoseconds_of(std::string_view literal) {
  const std::string upper = folded(literal);
  const auto wrong = [&] {
    return std::unexpected(fmt::format(
        "'{}' is not a duration; allowed is T#20ms, with the units d, h, m, s, ms, us, ns", literal));
  };
  std::string_view rest(upper);
  const std::size_t sharp = rest.find('#');
  if (sharp == std::string_view::npos) return wrong();
  const std::string_view type = rest.substr(0, sharp);
  if (type != "T" && type != "TIME" && type != "LT" && type != "LTIME") return wrong();
  rest.remove_prefix(sharp + 1);
  const bool negative = rest.starts_with('-');
  if (negative || rest.starts_with('+')) rest.remove_prefix(1);
  if (rest.empty()) return wrong();
  std::int64_t sum = 0;
  while (!rest.empty()) {
    std::int64_t whole = 0;
    std::int64_t parts = 0;
    std::int64_t scale = 1;
    if (!take_number(rest, whole, parts, scale)) return wrong();
    const auto unit = take_unit(rest);
    if (!unit) return wrong();
    while (rest.starts_with('_')) rest.remove_prefix(1);
    const double fraction = static_cast<double>(parts) / static_cast<double>(scale);
    const std::int64_t more = std::llround(fraction * static_cast<double>(unit->nanoseconds));
    if (whole > (kMost - more - sum) / unit->nanoseconds) {
      return std::unexpected(fmt::format("'{}' is longer than 292 years", literal));
    }
    sum += whole * unit->nanoseconds + more;
  }
  return negative ? -sum : sum;
}

}  // namespace plchost::iec
