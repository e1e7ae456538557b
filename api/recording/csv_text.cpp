#include "api/recording/csv_text.hpp"

#include <ctime>

#include <fmt/chrono.h>
#include <fmt/format.h>

namespace plchost {

std::string time_text(std::int64_t unix_ns) {
  if (unix_ns <= 0) return {};
  constexpr std::int64_t kPerMillisecond = 1'000'000;
  constexpr std::int64_t kPerSecond = 1'000'000'000;
  const auto seconds = static_cast<std::time_t>(unix_ns / kPerSecond);
  return fmt::format("{:%Y-%m-%dT%H:%M:%S}.{:03}Z", fmt::gmtime(seconds), unix_ns / kPerMillisecond % 1000);
}

std::string csv_cell(std::string_view text) {
  if (text.find_first_of(",\"\r\n") == std::string_view::npos) return std::string(text);
  std::string cell = "\"";
  for (const char c : text) cell.append(c == '"' ? 2 : 1, c);
  return cell + "\"";
}

}  // namespace plchost
