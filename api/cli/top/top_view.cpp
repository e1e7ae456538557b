#include "api/cli/top/top_view.hpp"

#include <algorithm>
#include <utility>

#include <control.h>
#include <fmt/format.h>

#include "api/dds/text.hpp"
#include "shm/base/names.hpp"

namespace plchost {

namespace {

constexpr std::size_t kMostFilter = 40;

bool is_shown(const Row& row, const std::vector<Column>& columns, std::string_view filter) {
  if (filter.empty()) return true;
  return std::ranges::any_of(columns, [&](const Column& column) {
    const auto cell = row.find(column.field);
    return cell != row.end() && cell->is_string() &&
           cell->get_ref<const std::string&>().find(filter) != std::string::npos;
  });
}

std::string of(std::string_view instance) {  // "line1 of cell1"
  const std::size_t slash = instance.find('/');
  return fmt::format("{} of {}", instance.substr(slash + 1), instance.substr(0, slash));
}

}  // namespace

void TopView::show(const std::vector<HostLook>& hosts, const TopFigures& figures) {
  hosts_ = hosts;
  figures_ = figures;
  const TopTable all = instance_table(hosts_, figures_, style_);
  instances_ = all.rows.size();
  states_.clear();
  for (const Row& row : all.rows) ++states_[row["state"].get<std::string>()];
  shown_ = table();
  keep_choice();
}

TopTable TopView::table() const {
  TopTable table = !inside_.empty()           ? task_table(hosts_, figures_, style_, inside_)
                   : page_ == Page::instances ? instance_table(hosts_, figures_, style_)
                   : page_ == Page::tasks     ? task_table(hosts_, figures_, style_)
                                              : core_table(hosts_, figures_, style_);
  std::erase_if(table.rows, [&](const Row& row) { return !is_shown(row, table.columns, filter_); });
  // A field that no row has sorts nothing.
  if (!sort_.empty()) static_cast<void>(sort_rows(table.rows, (descending_ ? "-" : "") + sort_));
  return table;
}

void TopView::keep_choice() {
  const auto found =
      std::ranges::find_if(shown_.rows, [&](const Row& row) { return row["name"] == chosen_; });
  if (found != shown_.rows.end()) place_ = static_cast<std::size_t>(found - shown_.rows.begin());
  place_ = shown_.rows.empty() ? 0 : std::min(place_, shown_.rows.size() - 1);
  chosen_ = shown_.rows.empty() ? "" : shown_.rows[place_]["name"].get<std::string>();
}

std::optional<TopCommand> TopView::take_command() {
  return std::exchange(command_, std::nullopt);
}

void TopView::press(TopKey key, std::size_t rows) {
  said_.clear();
  switch (question_) {
    case Question::filter:
      return press_in_filter(key);
    case Question::scheduler:
      return press_scheduler(key);
    case Question::confirm:
      return press_confirm(key);
    case Question::none:
      break;
  }
  if (std::exchange(help_, false)) return;
  press_in_list(key, rows);
}

void TopView::press_in_list(TopKey key, std::size_t rows) {
  const auto page = static_cast<std::ptrdiff_t>(rows);
  using enum TopKey::Kind;
  switch (key.kind) {
    case up:
      return move(-1);
    case down:
      return move(1);
    case page_up:
      return move(-page);
    case page_down:
      return move(page);
    case home:
      return move(-static_cast<std::ptrdiff_t>(shown_.rows.size()));
    case end:
      return move(static_cast<std::ptrdiff_t>(shown_.rows.size()));
    case enter:
      if (page_ == Page::cores || !inside_.empty() || chosen_.empty()) return;
      inside_ = chosen_instance();
      return turn_to(page_);
    case escape:
    case erase:
      if (!inside_.empty()) chosen_ = std::exchange(inside_, {});
      return turn_to(page_);
    case tab:
      inside_.clear();
      return turn_to(page_ == Page::instances ? Page::tasks
                     : page_ == Page::tasks   ? Page::cores
                                              : Page::instances);
    case sign:
      return press_sign(key.sign);
  }
}

void TopView::press_sign(char sign) {
  switch (sign) {
    case 'q':
      ended_ = true;
      return;
    case '1':
    case '2':
    case '3':
      inside_.clear();
      return turn_to(static_cast<Page>(sign - '1'));
    case 'j':
      return move(1);
    case 'k':
      return move(-1);
    case '<':
      return sort_by_next(-1);
    case '>':
      return sort_by_next(1);
    case 'r':
      descending_ = !descending_;
      break;
    case '/':
      question_ = Question::filter;
      return;
    case 'p':
      paused_ = !paused_;
      return;
    case 'h':
    case '?':
      help_ = true;
      return;
    case 'S':
      return ask(plc_OPERATION_START, {.verb = "Start", .done = "is started"});
    case 'T':
      return ask(plc_OPERATION_STOP, {.verb = "Stop", .done = "is stopped"});
    case 'W':
      return ask_for_scheduler();
    default:
      return say("no such key; '?' lists them");
  }
  shown_ = table();
  keep_choice();
}

void TopView::move(std::ptrdiff_t by) {
  if (shown_.rows.empty()) return;
  const auto last = static_cast<std::ptrdiff_t>(shown_.rows.size()) - 1;
  place_ =
      static_cast<std::size_t>(std::clamp(static_cast<std::ptrdiff_t>(place_) + by, std::ptrdiff_t{0}, last));
  chosen_ = shown_.rows[place_]["name"].get<std::string>();
}

void TopView::turn_to(Page page) {
  if (page != page_) sort_.clear();
  page_ = page;
  shown_ = table();
  keep_choice();
}

void TopView::sort_by_next(std::ptrdiff_t by) {
  // One more than columns: as they come.
  const auto count = static_cast<std::ptrdiff_t>(shown_.columns.size()) + 1;
  const auto found = std::ranges::find(shown_.columns, std::string_view(sort_), &Column::field);
  const auto at = found == shown_.columns.end() ? -1 : found - shown_.columns.begin();
  const auto next = (at + 1 + by + count) % count;
  sort_ = next == 0 ? "" : shown_.columns[static_cast<std::size_t>(next - 1)].field;
  shown_ = table();
  keep_choice();
}

void TopView::press_in_filter(TopKey key) {
  using enum TopKey::Kind;
  if (key.kind == enter) {
    question_ = Question::none;
    return;
  }
  if (key.kind == escape) {
    question_ = Question::none;
    filter_.clear();
  } else if (key.kind == erase) {
    if (!filter_.empty()) filter_.pop_back();
  } else if (key.kind == sign && filter_.size() < kMostFilter) {
    filter_ += key.sign;
  }
  shown_ = table();
  keep_choice();
}

std::string TopView::chosen_instance() const {
  if (!inside_.empty()) return inside_;
  if (page_ == Page::cores) return {};
  const std::size_t slash = chosen_.find('/');
  return slash == std::string::npos ? "" : chosen_.substr(0, chosen_.find('/', slash + 1));
}

const HostLook* TopView::host_of(std::string_view instance) const {
  const auto name = instance.substr(0, instance.find('/'));
  return find_host(hosts_, name);
}

void TopView::ask(std::int32_t operation, const Words& words, std::string argument) {
  const std::string instance = chosen_instance();
  if (instance.empty()) return say("choose an instance first");
  const std::size_t slash = instance.find('/');
  asked_ = TopCommand{.host = instance.substr(0, slash),
                      .instance = instance.substr(slash + 1),
                      .operation = operation,
                      .argument = std::move(argument),
                      .done = fmt::format("{} {}", of(instance), words.done)};
  question_text_ = fmt::format("{} {}{}? y: yes, any other key: no", words.verb, of(instance), words.to);
  question_ = Question::confirm;
}

void TopView::ask_for_scheduler() {
  const std::string instance = chosen_instance();
  const HostLook* const look = host_of(instance);
  if (instance.empty() || look == nullptr) return say("choose an instance first");
  schedulers_ = look->host.schedulers();
  question_text_ = fmt::format("Scheduler of {}?", of(instance));
  for (std::size_t i = 0; i < schedulers_.size(); ++i) {
    question_text_ += fmt::format(" {}: {}", i + 1, printable(schedulers_[i]));
  }
  question_ = Question::scheduler;
}

void TopView::press_scheduler(TopKey key) {
  question_ = Question::none;
  const auto at = static_cast<std::size_t>(key.sign - '1');
  if (key.kind != TopKey::Kind::sign || at >= schedulers_.size()) return;
  const std::string& scheduler = schedulers_[at];
  ask(plc_OPERATION_SET_SCHEDULER,
      {.verb = "Switch", .to = " to " + printable(scheduler), .done = "has " + printable(scheduler)},
      scheduler);
}

void TopView::press_confirm(TopKey key) {
  question_ = Question::none;
  auto asked = std::exchange(asked_, std::nullopt);
  const bool yes = key.kind == TopKey::Kind::sign && (key.sign == 'y' || key.sign == 'Y');
  if (!yes) return say("not done");
  command_ = std::move(asked);
}

}  // namespace plchost
