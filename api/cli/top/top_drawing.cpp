// How a TopView is drawn.
#include <algorithm>
#include <string_view>

#include <fmt/format.h>

#include "api/cli/top/top_view.hpp"
#include "shm/base/names.hpp"
#include "shm/base/utf8.hpp"

namespace plchost {

namespace {

constexpr std::size_t kMostLosses = 8;

constexpr std::string_view kTopKeys[] = {
    "1 2 3 Tab     instances, tasks, cores",
    "Up Down j k   choose a row; Page Up, Page Down, Home, End",
    "Enter         look into an instance: its tasks, last losses and exception",
    "Esc           back",
    "< >           sort by the column to the left, to the right; r: the other way round",
    "/             show only rows with this text; Enter keeps it, Esc ends it",
    "S T W         start, stop, switch the scheduler of the chosen instance; each asks first",
    "p             pause, and go on",
    "q             end",
};

TopLine::Look row_look(const Row& row) {
  const auto state = row.find("state");
  const bool has_one = state != row.end() && state->is_string();
  switch (health_of(has_one ? state->get_ref<const std::string&>() : "")) {
    case StateHealth::bad:
      return TopLine::Look::bad;
    case StateHealth::uncertain:
      return TopLine::Look::warning;
    case StateHealth::none:
    case StateHealth::well:
      break;
  }
  return TopLine::Look::plain;
}

}  // namespace

std::string cut_to(std::string_view text, std::size_t width) {
  std::size_t characters = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (continues_utf8(text[i])) continue;
    if (characters == width) return std::string(text.substr(0, i));
    ++characters;
  }
  return std::string(text);
}

std::vector<TopLine> TopView::draw(std::size_t width, std::size_t height) const {
  std::vector<TopLine> lines;
  draw_head(lines);
  if (help_) {
    draw_help(lines);
  } else {
    const std::size_t losses = inside_.empty() ? 0 : std::min(kMostLosses + 3, height / 2);
    const std::size_t used = lines.size() + losses + 1;
    draw_rows(lines, width, height > used ? height - used : 0);
    if (losses > 0) draw_losses(lines, width, losses);
  }
  lines.resize(height > 0 ? height - 1 : 0);
  if (height > 0) lines.push_back(foot());
  for (TopLine& line : lines) line.text = cut_to(line.text, width);
  return lines;
}

void TopView::draw_head(std::vector<TopLine>& lines) const {
  std::string text = fmt::format("plcctl top: {}, {}", count_text(hosts_.size(), "host"),
                                 count_text(instances_, "instance"));
  for (const auto& [state, count] : states_) text += fmt::format(", {} {}", count, state);
  if (paused_) text += "  PAUSED";
  lines.push_back({.text = std::move(text), .look = TopLine::Look::title});
  const auto mark = [&](Page page, const char* name) {
    return inside_.empty() && page == page_ ? fmt::format("[{}]", name) : fmt::format(" {} ", name);
  };
  std::string pages =
      mark(Page::instances, "1 instances") + mark(Page::tasks, "2 tasks") + mark(Page::cores, "3 cores");
  if (!inside_.empty()) pages += fmt::format("  [{}]", inside_);
  if (!sort_.empty())
    pages += fmt::format("  sorted by {}{}", sort_, descending_ ? ", the greatest first" : "");
  if (!filter_.empty()) pages += fmt::format("  with '{}'", printable(filter_));
  lines.push_back({.text = std::move(pages)});
}

void TopView::draw_rows(std::vector<TopLine>& lines, std::size_t width, std::size_t height) const {
  if (shown_.rows.empty()) {
    lines.push_back({.text = hosts_.empty() ? "no host answers" : "nothing to show"});
    return;
  }
  if (height < 2) return;
  const auto table = table_lines(shown_.rows, shown_.columns, {.coloured = false, .width = width});
  lines.push_back({.text = table.front() + std::string(width, ' '), .look = TopLine::Look::header});
  const std::size_t room = height - 1;
  const std::size_t first = place_ < room ? 0 : place_ - room + 1;
  for (std::size_t i = first; i < shown_.rows.size() && i < first + room; ++i) {
    const bool chosen = i == place_;
    lines.push_back({.text = chosen ? table[i + 1] + std::string(width, ' ') : table[i + 1],
                     .look = chosen ? TopLine::Look::chosen : row_look(shown_.rows[i])});
  }
}

void TopView::draw_losses(std::vector<TopLine>& lines, std::size_t width, std::size_t height) const {
  const std::string exception = exception_line(hosts_, inside_);
  lines.push_back({});
  lines.push_back({.text = exception.empty() ? "no exception" : exception,
                   .look = exception.empty() ? TopLine::Look::plain : TopLine::Look::bad});
  TopTable losses = loss_table(hosts_, inside_);
  if (losses.rows.empty()) {
    lines.push_back({.text = "no cycle was lost"});
    return;
  }
  losses.rows.resize(std::min({losses.rows.size(), kMostLosses, height > 3 ? height - 3 : 0}));
  const auto table = table_lines(losses.rows, losses.columns, {.coloured = false, .width = width});
  for (std::size_t i = 0; i < table.size(); ++i) {
    lines.push_back({.text = i == 0 ? table[i] + std::string(width, ' ') : table[i],
                     .look = i == 0 ? TopLine::Look::header : TopLine::Look::plain});
  }
}

void TopView::draw_help(std::vector<TopLine>& lines) const {
  lines.push_back({});
  for (const std::string_view key : kTopKeys) lines.push_back({.text = std::string(key)});
}

TopLine TopView::foot() const {
  if (question_ == Question::filter) return {.text = "/" + printable(filter_), .look = TopLine::Look::title};
  if (question_ != Question::none) return {.text = question_text_, .look = TopLine::Look::warning};
  if (!said_.empty()) return {.text = said_, .look = TopLine::Look::title};
  return {.text =
              "q end  Enter look into  < > sort  / filter  S start  T stop  W scheduler  p pause  ? keys"};
}

}  // namespace plchost
