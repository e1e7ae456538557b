#include "api/cli/progress_board.hpp"

#include <algorithm>
#include <cstdio>

#include <fmt/format.h>
#include <unistd.h>

#include "shm/base/names.hpp"

namespace plchost {

std::string progress_line(std::string_view name, std::size_t width, std::uint64_t received,
                          std::uint64_t size) {
  constexpr std::uint64_t kBar = 30;
  constexpr std::uint64_t kPercent = 100;
  constexpr double kMib = 1024.0 * 1024.0;
  const std::uint64_t done = size == 0 ? 0 : std::min(received, size);
  const std::uint64_t whole = std::max<std::uint64_t>(size, 1);
  const auto marks = static_cast<std::size_t>(done * kBar / whole);
  return fmt::format("{:<{}}  [{:<{}}] {:3} %  {:.1f} of {:.1f} MiB{}", name, width, std::string(marks, '#'),
                     kBar, done * kPercent / whole, static_cast<double>(done) / kMib,
                     static_cast<double>(size) / kMib, done == whole ? ", loading" : "");
}

ProgressBoard::ProgressBoard(const std::vector<std::string>& hosts, std::uint64_t size)
    : size_(size), terminal_(::isatty(STDERR_FILENO) != 0) {
  for (const std::string& host : hosts) lines_.push_back({.host = host});
}

ProgressBoard::~ProgressBoard() {
  if (terminal_) clear();
}

void ProgressBoard::show(std::string_view host, std::uint64_t received) {
  const std::lock_guard lock(mutex_);
  const auto line = std::ranges::find(lines_, host, &Line::host);
  if (line == lines_.end() || !terminal_) return;
  line->received = received;
  const TimePoint now = MonotonicClock::now();
  if (now < next_ && received != size_) return;
  next_ = now + kPeriod;
  draw();
}

void ProgressBoard::end(std::string_view host) {
  const std::lock_guard lock(mutex_);
  const auto line = std::ranges::find(lines_, host, &Line::host);
  if (line == lines_.end() || !terminal_) return;
  line->ended = true;
  draw();
}

void ProgressBoard::draw() {
  clear();
  std::size_t width = 0;
  for (const Line& line : lines_) width = std::max(width, line.host.size());
  std::string text;
  for (const Line& line : lines_) {
    if (line.ended) continue;
    text += progress_line(printable(line.host), width, line.received, size_) + "\n";
    ++drawn_;
  }
  fmt::print(stderr, "{}", text);
}

// Up to the first of our lines, and all below it away.
void ProgressBoard::clear() {
  if (drawn_ > 0) fmt::print(stderr, "\033[{}A\r\033[J", drawn_);
  drawn_ = 0;
}

}  // namespace plchost
