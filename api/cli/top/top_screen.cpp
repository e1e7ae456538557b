#include "api/cli/top/top_screen.hpp"

#include <clocale>
#include <cstdio>
#include <cstdlib>
#include <string>

#include <curses.h>
#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include "shm/base/names.hpp"

namespace plchost {

namespace {

enum Pair : short { kWarning = 1, kBad = 2 };
constexpr int kEscapeDelayMs = 25;

attr_t attributes_of(TopLine::Look look, bool coloured) {
  const auto pair = [&](Pair which, attr_t else_) {
    return coloured ? static_cast<attr_t>(COLOR_PAIR(which)) : else_;
  };
  switch (look) {
    case TopLine::Look::plain:
      return A_NORMAL;
    case TopLine::Look::title:
      return A_BOLD;
    case TopLine::Look::header:
      return A_UNDERLINE;
    case TopLine::Look::chosen:
      return A_REVERSE;
    case TopLine::Look::warning:
      return pair(kWarning, A_BOLD);
    case TopLine::Look::bad:
      return pair(kBad, A_BOLD);
  }
  return A_NORMAL;
}

std::optional<TopKey> key_of(int code) {
  using enum TopKey::Kind;
  switch (code) {
    case KEY_UP:
      return TopKey{.kind = up};
    case KEY_DOWN:
      return TopKey{.kind = down};
    case KEY_PPAGE:
      return TopKey{.kind = page_up};
    case KEY_NPAGE:
      return TopKey{.kind = page_down};
    case KEY_HOME:
      return TopKey{.kind = home};
    case KEY_END:
      return TopKey{.kind = end};
    case KEY_ENTER:
    case '\n':
    case '\r':
      return TopKey{.kind = enter};
    case '\t':
      return TopKey{.kind = tab};
    case KEY_LEFT:
    case '\x1b':
      return TopKey{.kind = escape};
    case KEY_BACKSPACE:
    case '\b':
    case '\x7f':
      return TopKey{.kind = erase};
    default:
      break;
  }
  const bool is_sign = code >= ' ' && code < '\x7f';
  return is_sign ? std::optional(TopKey{.sign = static_cast<char>(code)}) : std::nullopt;
}

}  // namespace

struct TopScreen::Terminal {
  SCREEN* screen = nullptr;
  bool coloured = false;
};

TopScreen::TopScreen(std::unique_ptr<Terminal> terminal) noexcept : terminal_(std::move(terminal)) {}

Result<std::unique_ptr<TopScreen>> TopScreen::open(bool coloured) {
  if (::isatty(STDIN_FILENO) == 0 || ::isatty(STDOUT_FILENO) == 0) {
    return failure(ErrorCode::unsupported,
                   "'top' needs a terminal; for programs there are 'list tasks --json' and 'watch tasks'");
  }
  std::setlocale(LC_CTYPE, "");  // the signs of trends have more than a byte
  const char* const kind = std::getenv("TERM");
  auto terminal = std::make_unique<Terminal>();
  terminal->screen = ::newterm(nullptr, stdout, stdin);
  if (terminal->screen == nullptr) {
    return failure(ErrorCode::unsupported, fmt::format("terminals of the kind '{}' (TERM) are not known here",
                                                       shown(kind == nullptr ? "" : kind)));
  }
  ::cbreak();
  ::noecho();
  ::nonl();
  ::keypad(stdscr, TRUE);
  ::set_escdelay(kEscapeDelayMs);
  ::curs_set(0);
  terminal->coloured = coloured && ::has_colors() && ::start_color() == OK;
  if (terminal->coloured) {
    ::use_default_colors();
    ::init_pair(kWarning, COLOR_YELLOW, -1);
    ::init_pair(kBad, COLOR_RED, -1);
  }
  return std::unique_ptr<TopScreen>(new TopScreen(std::move(terminal)));
}

TopScreen::~TopScreen() {
  ::endwin();
  ::delscreen(terminal_->screen);
}

std::size_t TopScreen::width() const {
  return static_cast<std::size_t>(getmaxx(stdscr));
}
std::size_t TopScreen::height() const {
  return static_cast<std::size_t>(getmaxy(stdscr));
}

void TopScreen::draw(std::span<const TopLine> lines) {
  ::erase();
  for (std::size_t row = 0; row < lines.size(); ++row) {
    const attr_t attributes = attributes_of(lines[row].look, terminal_->coloured);
    attrset(static_cast<int>(attributes));
    mvaddstr(static_cast<int>(row), 0, lines[row].text.c_str());
  }
  attrset(A_NORMAL);
  ::refresh();
}

std::optional<TopKey> TopScreen::key(Duration patience) {
  using Milliseconds = std::chrono::duration<int, std::milli>;
  timeout(0);
  int code = getch();
  if (code == ERR) {
    // A terminal that is gone answers at once, which getch() does not tell from no key.
    pollfd input{.fd = STDIN_FILENO, .events = POLLIN, .revents = 0};
    ::poll(&input, 1, std::chrono::duration_cast<Milliseconds>(patience).count());
    constexpr unsigned kGone = POLLHUP | POLLERR | POLLNVAL;
    is_gone_ = is_gone_ || (static_cast<unsigned>(input.revents) & kGone) != 0;
    code = getch();
  }
  return code == ERR ? std::nullopt : key_of(code);
}

}  // namespace plchost
