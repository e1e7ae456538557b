#include "shm/log/log_line.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <ctime>
#include <utility>

namespace plchost {

namespace {

constexpr std::string_view kTimeForm = "0000-00-00 00:00:00.000 ";
constexpr std::array kLevelNames = {
    std::pair{std::string_view("trace"), LogLevel::debug},
    std::pair{std::string_view("debug"), LogLevel::debug},
    std::pair{std::string_view("info"), LogLevel::info},
    std::pair{std::string_view("warning"), LogLevel::warning},
    std::pair{std::string_view("error"), LogLevel::error},
    std::pair{std::string_view("critical"), LogLevel::error},
};

int number_at(std::string_view text, std::size_t from, std::size_t digits) {
  int number = 0;
  std::from_chars(text.data() + from, text.data() + from + digits, number);
  return number;
}

// Local time, as spdlog writes it.
std::optional<std::int64_t> parse_time(std::string_view text) {
  if (text.size() < kTimeForm.size()) return std::nullopt;
  for (std::size_t i = 0; i < kTimeForm.size(); ++i) {
    const bool digit = text[i] >= '0' && text[i] <= '9';
    if (kTimeForm[i] == '0' ? !digit : text[i] != kTimeForm[i]) return std::nullopt;
  }
  std::tm parts{};
  parts.tm_year = number_at(text, 0, 4) - 1900;
  parts.tm_mon = number_at(text, 5, 2) - 1;
  parts.tm_mday = number_at(text, 8, 2);
  parts.tm_hour = number_at(text, 11, 2);
  parts.tm_min = number_at(text, 14, 2);
  parts.tm_sec = number_at(text, 17, 2);
  parts.tm_isdst = -1;
  const std::time_t seconds = std::mktime(&parts);
  if (seconds < 0) return std::nullopt;
  return (std::int64_t{seconds} * 1000 + number_at(text, 20, 3)) * 1'000'000;
}

// The word in front of `separator`, which is taken away with it.
std::string_view take_word(std::string_view& rest, std::string_view separator) {
  const std::size_t end = rest.find(separator);
  if (end == std::string_view::npos) return {};
  const std::string_view word = rest.substr(0, end);
  rest.remove_prefix(end + separator.size());
  return word;
}

}  // namespace

std::optional<LogLine> parse_log_line(std::string_view line) {
  const auto time = parse_time(line);
  if (!time) return std::nullopt;
  line.remove_prefix(kTimeForm.size());
  const std::string_view level = take_word(line, " ");
  const auto* const known = std::ranges::find(kLevelNames, level, [](const auto& one) { return one.first; });
  if (known == kLevelNames.end()) return std::nullopt;
  const std::string_view program = take_word(line, ": ");
  if (program.empty()) return std::nullopt;
  return LogLine{.time_unix_ns = *time, .level = known->second, .program = program, .text = line};
}

}  // namespace plchost
