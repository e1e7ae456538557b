#include "api/cli/terminal.hpp"

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <string_view>

#include <sys/ioctl.h>
#include <unistd.h>

namespace plchost {

namespace {

constexpr std::size_t kLeastWidth = 40;
constexpr std::size_t kGreatestWidth = 400;

std::string_view variable(const char* name) {
  const char* const value = std::getenv(name);
  return value == nullptr ? std::string_view() : value;
}

std::size_t width() {
  winsize size{};
  if (::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0) return size.ws_col;
  const std::string_view columns = variable("COLUMNS");
  std::size_t number = PlotStyle{}.width;
  (void)std::from_chars(columns.data(), columns.data() + columns.size(), number);
  return number;
}

bool speaks_utf8() {
  for (const char* name : {"LC_ALL", "LC_CTYPE", "LANG"}) {
    const std::string_view locale = variable(name);
    if (locale.empty()) continue;
    return locale.find("UTF-8") != std::string_view::npos || locale.find("utf8") != std::string_view::npos;
  }
  return false;
}

}  // namespace

PlotStyle terminal_style() {
  return {.width = std::clamp(width(), kLeastWidth, kGreatestWidth), .unicode = speaks_utf8()};
}

std::size_t terminal_width() {
  return ::isatty(STDOUT_FILENO) != 0 ? std::clamp(width(), kLeastWidth, kGreatestWidth) : 0;
}

bool shows_colours() {
  return ::isatty(STDOUT_FILENO) != 0 && variable("NO_COLOR").empty() && variable("TERM") != "dumb";
}

}  // namespace plchost
