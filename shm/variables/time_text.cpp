#include "shm/variables/time_text.hpp"

#include <array>
#include <cctype>
#include <chrono>
#include <cmath>
#include <iterator>
#include <limits>
#include <optional>

#include <fmt/format.h>

#include "shm/base/names.hpp"

namespace plchost {

namespace {

struct Unit {
  std::string_view name;
  std::uint64_t nanoseconds;
};
constexpr std::uint64_t kSecond = 1'000'000'000;
constexpr std::uint64_t kDay = 86'400 * kSecond;
// The order in which a text has them. A name is before those that it begins with.
constexpr std::array<Unit, 7> kUnits{{{"d", kDay},
                                      {"h", 3'600 * kSecond},
                                      {"ms", 1'000'000},
                                      {"m", 60 * kSecond},
                                      {"s", kSecond},
                                      {"us", 1'000},
                                      {"ns", 1}}};
constexpr std::array<std::size_t, 7> kFromLargest{0, 1, 3, 4, 2, 5, 6};
constexpr std::uint64_t kMost = std::numeric_limits<std::int64_t>::max();
constexpr std::string_view kRange = "a year from 1678 to 2261";

bool is_digit(char c) noexcept {
  return c >= '0' && c <= '9';
}

/// 12.345 as it stands in a text: digits with _ between them.
struct Decimal {
  std::uint64_t whole = 0;
  double fraction = 0;
};

std::optional<Decimal> take_decimal(std::string_view& text) {
  Decimal number;
  double scale = 1;
  bool point = false;
  char before = '.';
  while (!text.empty()) {
    const char c = text.front();
    if (is_digit(c)) {
      const auto digit = static_cast<std::uint64_t>(c - '0');
      if (point) {
        scale /= 10;
        number.fraction += static_cast<double>(digit) * scale;
      } else {
        if (number.whole > (kMost - digit) / 10) return std::nullopt;
        number.whole = number.whole * 10 + digit;
      }
    } else if (!is_digit(before) || (c != '_' && (c != '.' || point))) {
      break;
    }
    point = point || c == '.';
    before = c;
    text.remove_prefix(1);
  }
  return is_digit(before) ? std::optional(number) : std::nullopt;
}

std::optional<std::uint64_t> take_unit(std::string_view& text) {
  for (const Unit& unit : kUnits) {
    if (text.size() < unit.name.size()) continue;
    bool same = true;
    for (std::size_t i = 0; i < unit.name.size(); ++i) {
      same = same && std::tolower(static_cast<unsigned char>(text[i])) == unit.name[i];
    }
    if (!same) continue;
    text.remove_prefix(unit.name.size());
    if (text.size() > 1 && text.front() == '_') text.remove_prefix(1);
    return unit.nanoseconds;
  }
  return std::nullopt;
}

std::string duration_text(std::int64_t nanoseconds) {
  const bool negative = nanoseconds < 0;
  auto left = static_cast<std::uint64_t>(nanoseconds);
  if (negative) left = 0 - left;
  std::string text = negative ? "T#-" : "T#";
  if (left == 0) return text + "0s";
  for (const std::size_t index : kFromLargest) {
    const Unit& unit = kUnits.at(index);
    if (left >= unit.nanoseconds)
      fmt::format_to(std::back_inserter(text), "{}{}", left / unit.nanoseconds, unit.name);
    left %= unit.nanoseconds;
  }
  return text;
}

Result<std::int64_t> parse_duration(std::string_view text) {
  const auto wrong = [text] {
    return failure(
        ErrorCode::invalid_argument,
        fmt::format("'{}' is not a duration; allowed is T#1m30s, T#-2.5ms, with the units d, h, m, s, "
                    "ms, us, ns, up to 292 years",
                    shown(text)));
  };
  std::string_view rest = text;
  const bool negative = rest.starts_with('-');
  if (negative || rest.starts_with('+')) rest.remove_prefix(1);
  if (rest.empty()) return wrong();
  const std::uint64_t limit = negative ? kMost + 1 : kMost;
  std::uint64_t sum = 0;
  while (!rest.empty()) {
    const auto number = take_decimal(rest);
    if (!number) return wrong();
    const auto unit = take_unit(rest);
    if (!unit) return wrong();
    const auto more = static_cast<std::uint64_t>(std::llround(number->fraction * static_cast<double>(*unit)));
    if (more > limit - sum || number->whole > (limit - sum - more) / *unit) return wrong();
    sum += number->whole * *unit + more;
  }
  return static_cast<std::int64_t>(negative ? 0 - sum : sum);
}

/// A number of exactly so many digits.
std::optional<unsigned> take_digits(std::string_view& text, std::size_t digits) {
  if (text.size() < digits) return std::nullopt;
  unsigned number = 0;
  for (const char c : text.substr(0, digits)) {
    if (!is_digit(c)) return std::nullopt;
    number = number * 10 + static_cast<unsigned>(c - '0');
  }
  text.remove_prefix(digits);
  return number;
}

bool take(std::string_view& text, char c) {
  if (!text.starts_with(c)) return false;
  text.remove_prefix(1);
  return true;
}

/// Nanoseconds since midnight.
std::optional<std::uint64_t> take_time_of_day(std::string_view& text) {
  constexpr unsigned kHours = 24;
  constexpr unsigned kSixty = 60;
  constexpr std::size_t kFractionDigits = 9;
  const auto hour = take_digits(text, 2);
  if (!hour || *hour >= kHours || !take(text, ':')) return std::nullopt;
  const auto minute = take_digits(text, 2);
  if (!minute || *minute >= kSixty || !take(text, ':')) return std::nullopt;
  const auto second = take_digits(text, 2);
  if (!second || *second >= kSixty) return std::nullopt;
  std::uint64_t sum = ((*hour * kSixty + *minute) * std::uint64_t{kSixty} + *second) * kSecond;
  if (!take(text, '.')) return sum;
  std::uint64_t worth = kSecond / 10;
  std::size_t digits = 0;
  for (; !text.empty() && is_digit(text.front()); ++digits, worth /= 10) {
    if (digits == kFractionDigits) return std::nullopt;
    sum += static_cast<std::uint64_t>(text.front() - '0') * worth;
    text.remove_prefix(1);
  }
  return digits > 0 ? std::optional(sum) : std::nullopt;
}

/// Days since 1970.
std::optional<std::int64_t> take_date(std::string_view& text) {
  constexpr unsigned kFirstYear = 1678;
  constexpr unsigned kLastYear = 2261;
  const auto year = take_digits(text, 4);
  if (!year || *year < kFirstYear || *year > kLastYear || !take(text, '-')) return std::nullopt;
  const auto month = take_digits(text, 2);
  if (!month || !take(text, '-')) return std::nullopt;
  const auto day = take_digits(text, 2);
  if (!day) return std::nullopt;
  const std::chrono::year_month_day date(std::chrono::year(static_cast<int>(*year)),
                                         std::chrono::month(*month), std::chrono::day(*day));
  if (!date.ok()) return std::nullopt;
  return std::chrono::sys_days(date).time_since_epoch().count();
}

std::string time_of_day_text(std::uint64_t nanoseconds) {
  const std::uint64_t seconds = nanoseconds / kSecond;
  std::string text = fmt::format("{:02}:{:02}:{:02}", seconds / 3600, seconds / 60 % 60, seconds % 60);
  if (const std::uint64_t fraction = nanoseconds % kSecond; fraction != 0) {
    fmt::format_to(std::back_inserter(text), ".{:09}", fraction);
    while (text.back() == '0') text.pop_back();
  }
  return text;
}

std::string date_text(std::chrono::sys_days day) {
  const std::chrono::year_month_day date(day);
  return fmt::format("{:04}-{:02}-{:02}", static_cast<int>(date.year()), static_cast<unsigned>(date.month()),
                     static_cast<unsigned>(date.day()));
}

Result<std::int64_t> parse_moment(TimeForm form, std::string_view text) {
  std::string_view rest = text;
  std::optional<std::int64_t> days = 0;
  if (form != TimeForm::time_of_day) days = take_date(rest);
  std::optional<std::uint64_t> time = 0;
  if (form == TimeForm::date_and_time && days && !take(rest, '-')) time = std::nullopt;
  if (form != TimeForm::date && days && time) time = take_time_of_day(rest);
  if (days && time && rest.empty()) {
    return *days * static_cast<std::int64_t>(kDay) + static_cast<std::int64_t>(*time);
  }
  constexpr std::array<std::string_view, 4> kExamples{"", "D#2026-11-25", "TOD#12:30:00.5",
                                                      "DT#2026-11-25-12:30:00"};
  constexpr std::array<std::string_view, 4> kNames{"", "a date", "a time of day", "a date and time"};
  const auto index = static_cast<std::size_t>(form);
  return failure(ErrorCode::invalid_argument,
                 fmt::format("'{}' is not {}; allowed is {}{}{}", shown(text), kNames.at(index),
                             kExamples.at(index), form == TimeForm::time_of_day ? "" : ", with ",
                             form == TimeForm::time_of_day ? ", below 24:00:00" : kRange));
}

}  // namespace

std::string time_text(TimeForm form, std::int64_t nanoseconds) {
  if (form == TimeForm::duration) return duration_text(nanoseconds);
  const auto days = std::chrono::floor<std::chrono::days>(std::chrono::nanoseconds(nanoseconds));
  const auto day = std::chrono::sys_days(days);
  if (form == TimeForm::date) return "D#" + date_text(day);
  if (form == TimeForm::time_of_day) {
    return days.count() == 0 ? "TOD#" + time_of_day_text(static_cast<std::uint64_t>(nanoseconds))
                             : fmt::format("{}", nanoseconds);
  }
  // In whole seconds: the begin of the first day is before the first nanosecond that there is.
  const auto whole = std::chrono::floor<std::chrono::seconds>(std::chrono::nanoseconds(nanoseconds));
  const auto second = static_cast<std::uint64_t>((whole - days).count());
  std::int64_t rest = nanoseconds % static_cast<std::int64_t>(kSecond);
  if (rest < 0) rest += static_cast<std::int64_t>(kSecond);
  return fmt::format("DT#{}-{}", date_text(day),
                     time_of_day_text(second * kSecond + static_cast<std::uint64_t>(rest)));
}

Result<std::int64_t> parse_time(TimeForm form, std::string_view text) {
  return form == TimeForm::duration ? parse_duration(text) : parse_moment(form, text);
}

}  // namespace plchost
