#include "instances/runtime/debug/breakpoint.hpp"

#include <algorithm>
#include <tuple>
#include <utility>

#include <fmt/format.h>

#include "instances/runtime/debug/debug_words.hpp"
#include "shm/base/names.hpp"
#include "shm/base/trimmed.hpp"

namespace plchost {

namespace {

constexpr std::size_t kMaxLogText = 200;

std::unexpected<Error> bad_order(std::string text) {
  return failure(ErrorCode::invalid_argument, std::move(text));
}

}  // namespace

Result<HitRule> HitRule::parse(std::string_view text) {
  HitRule rule{.kind = Kind::at_least};
  std::string_view digits = text;
  if (text.starts_with(">=")) digits.remove_prefix(2);
  if (text.starts_with('=') || text.starts_with('%')) {
    rule.kind = text.front() == '=' ? Kind::equal : Kind::multiple;
    digits.remove_prefix(1);
  }
  rule.count = number_in<std::uint64_t>(trimmed(digits)).value_or(0);
  if (rule.count > 0) return rule;
  return bad_order(fmt::format(
      "'{}' is no count of hits: =N (the N-th), %N (each N-th) and >=N (from the N-th on) are", shown(text)));
}

bool HitRule::holds(std::uint64_t hit) const noexcept {
  switch (kind) {
    case Kind::all:
      return true;
    case Kind::equal:
      return hit == count;
    case Kind::multiple:
      return hit % count == 0;
    case Kind::at_least:
      return hit >= count;
  }
  return true;
}

Result<BreakpointOrder> BreakpointOrder::parse(std::string_view text) {
  BreakpointOrder order;
  text = trimmed(text);
  const std::string_view whole = text;
  const std::size_t quoted = quoted_size(text);
  // Words in a quoted place are none of the order.
  const std::string plain = quoted == 0 ? std::string() : fmt::format("PLACE{}", text.substr(quoted));
  if (quoted > 0) text = plain;
  // The last part may hold the words of the others.
  const auto cut = [&text](std::string_view word) {
    const std::string wanted = fmt::format(" {} ", word);
    const std::size_t found = text.find(wanted);
    if (found == std::string_view::npos) return std::string_view();
    return trimmed(text.substr(found + wanted.size()));
  };
  const auto shorten = [&text](std::string_view part) {
    text = trimmed(text.substr(0, static_cast<std::size_t>(part.data() - text.data())));
    text = trimmed(text.substr(0, text.find_last_of(' ')));
  };
  for (const auto& [word, member] :
       {std::pair("log", &BreakpointOrder::log), std::pair("if", &BreakpointOrder::condition),
        std::pair("hits", &BreakpointOrder::hits)}) {
    const auto part = cut(word);
    if (part.empty()) continue;
    order.*member = part;
    shorten(part);
  }
  order.place = quoted == 0 ? text : without_quotes(whole.substr(0, quoted));
  const bool is_open = quoted == 0 && whole.starts_with('"');
  if (!order.place.empty() && !is_open && text.find(' ') == std::string_view::npos) return order;
  return bad_order(
      fmt::format("'{}' is no breakpoint: PLACE [hits COUNT] [if CONDITION] [log TEXT] is; PLACE is "
                  "POU:LINE, FILE:LINE or POU; a FILE with blanks stands in quotation marks",
                  shown(whole)));
}

Result<LogTemplate> LogTemplate::parse(std::string_view text, const FindValue& find) {
  if (text.size() > kMaxLogText)
    return bad_order(fmt::format("a log text has at most {} characters", kMaxLogText));
  LogTemplate made;
  for (;;) {
    const std::size_t open = text.find('{');
    made.texts.emplace_back(text.substr(0, open));
    if (open == std::string_view::npos) return made;
    const std::size_t close = text.find('}', open);
    if (close == std::string_view::npos) return bad_order("a '}' is missing in the log text");
    const auto name = trimmed(text.substr(open + 1, close - open - 1));
    PLCHOST_TRY_ASSIGN(const auto place, find(name));
    if (place.bytes > kMaxValueBytes || is_string(place.type))
      return bad_order(fmt::format("'{}' is a string, which a log text cannot have", shown(name)));
    if (made.values.size() == kMaxValues)
      return bad_order(fmt::format("a log text has at most {} values", kMaxValues));
    made.values.push_back(place);
    text.remove_prefix(close + 1);
  }
}

BreakpointTable::BreakpointTable(std::vector<std::shared_ptr<const Breakpoint>> breakpoints, std::size_t pous)
    : breakpoints_(std::move(breakpoints)) {
  std::ranges::sort(breakpoints_, {}, [](const auto& breakpoint) {
    return std::tuple(breakpoint->place.pou, breakpoint->place.line, breakpoint->id);
  });
  for (std::uint32_t pou = 0; pou <= pous; ++pou) {
    const auto first = std::ranges::lower_bound(breakpoints_, pou, {},
                                                [](const auto& breakpoint) { return breakpoint->place.pou; });
    first_.push_back(static_cast<std::uint32_t>(first - breakpoints_.begin()));
  }
}

std::span<const std::shared_ptr<const Breakpoint>> BreakpointTable::at(std::uint32_t pou,
                                                                       std::uint32_t line) const noexcept {
  if (pou + std::size_t{1} >= first_.size()) return {};
  std::size_t begin = first_[pou];
  const std::size_t last = first_[pou + std::size_t{1}];
  while (begin < last && breakpoints_[begin]->place.line != line) ++begin;
  std::size_t end = begin;
  while (end < last && breakpoints_[end]->place.line == line) ++end;
  return std::span(breakpoints_).subspan(begin, end - begin);
}

}  // namespace plchost
