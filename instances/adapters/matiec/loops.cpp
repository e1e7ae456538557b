#include "instances/adapters/matiec/loops.hpp"

#include <algorithm>
#include <cstddef>
#include <optional>

#include <fmt/format.h>

#include "instances/adapters/iec/c_texts.hpp"

namespace plchost::matiec {

namespace {

constexpr std::string_view kFlag = "int __do_increment = 0;";
constexpr std::string_view kWhile = "while( ";

/// Takes parts off the front of a text.
class Parts {
 public:
  explicit Parts(std::string_view text) : rest_(text) {}
  bool skip(std::string_view word) {
    const bool there = rest_.starts_with(word);
    if (there) rest_.remove_prefix(word.size());
    return there;
  }
  /// The text up to a word outside of parentheses, which is taken, too.
  std::optional<std::string_view> until(std::string_view word) {
    const std::size_t at = iec::find_outside(rest_, word);
    if (at == std::string_view::npos) return std::nullopt;
    const std::string_view part = rest_.substr(0, at);
    rest_.remove_prefix(at + word.size());
    return part;
  }
  [[nodiscard]] std::string_view rest() const { return rest_; }

 private:
  std::string_view rest_;
};

// "((BY) > 0)? (VARIABLE + (BY) <= (END)) : (VARIABLE + (BY) >= (END)) ", or "VARIABLE < END"
std::optional<std::string> first_condition(std::string_view condition) {
  Parts parts(condition);
  if (!parts.skip("((")) {
    const auto variable = parts.until(" < ");
    if (!variable) return std::nullopt;
    return fmt::format("{} <= {}", *variable, parts.rest());
  }
  const auto by = parts.until(")");
  if (!by || !parts.skip(" > 0)? (")) return std::nullopt;
  const auto variable = parts.until(" + (");
  if (!variable || parts.until(")") != by || !parts.skip(" <= (")) return std::nullopt;
  const auto end = parts.until(")");
  if (!end || !parts.skip(") : (")) return std::nullopt;
  return fmt::format("(({0}) > 0)? ({1} <= ({2})) : ({1} >= ({2}))", *by, *variable, *end);
}

}  // namespace

std::string with_first_turns(std::string_view code) {
  std::string made;
  for (std::size_t at = code.find(kFlag); at != std::string_view::npos; at = code.find(kFlag)) {
    const std::size_t begin = code.find_first_not_of(" \n", at + kFlag.size());
    const bool is_loop = begin != std::string_view::npos && code.substr(begin).starts_with(kWhile);
    const std::size_t from = is_loop ? begin + kWhile.size() : at + kFlag.size();
    const std::size_t end = is_loop ? iec::find_outside(code, " ) {", from) : std::string_view::npos;
    const auto first =
        end == std::string_view::npos ? std::nullopt : first_condition(code.substr(from, end - from));
    made += code.substr(0, from);
    if (first) {
      std::string in_one_line = *first;
      std::ranges::replace(in_one_line, '\n', ' ');  // the lines of the code stay as they are
      made += fmt::format("!__do_increment ? ({}) : (", in_one_line);
      made += code.substr(from, end - from);
      made += ')';
    }
    code.remove_prefix(first ? end : from);
  }
  made += code;
  return made;
}

}  // namespace plchost::matiec
