#include "instances/adapters/matiec/complements.hpp"

#include <algorithm>
#include <cstddef>

#include <fmt/format.h>

#include "instances/adapters/iec/c_texts.hpp"

namespace plchost::matiec {

namespace {

// The first operand in "((A & B) | ~(C))" that has a type; empty: all are numbers without one. iec2c takes
// no operands of several types.
std::string_view typed_operand(std::string_view expression) {
  constexpr std::string_view kBetween = "(~)&|^ \n";
  for (std::size_t begin = expression.find_first_not_of(kBetween); begin != std::string_view::npos;) {
    std::size_t end = begin;
    while (end < expression.size() && !kBetween.substr(2).contains(expression[end])) {
      const bool opens = expression[end] == '(' || expression[end] == '[';
      const std::size_t close = opens ? iec::find_close(expression, end) : end;
      if (close == std::string_view::npos) return {};
      end = close + 1;
    }
    const bool is_number = expression[begin] >= '0' && expression[begin] <= '9';
    if (!is_number) return expression.substr(begin, end - begin);
    begin = expression.find_first_not_of(kBetween, end);
  }
  return {};
}

}  // namespace

std::string with_narrow_complements(std::string_view code) {
  std::string made;
  char quote = '\0';
  for (std::size_t i = 0; i < code.size(); ++i) {
    const char c = code[i];
    if (quote != '\0') {
      if (c == quote || c == '\n') quote = '\0';
      if (c == '\\' && i + 1 < code.size()) made += code[i++];
    } else if (c == '"' || c == '\'') {
      quote = c;
    } else if (code.substr(i).starts_with("~(")) {
      const std::size_t close = iec::find_close(code, i + 1);
      std::string like(close == std::string_view::npos ? std::string_view()
                                                       : typed_operand(code.substr(i + 1, close - i)));
      std::ranges::replace(like, '\n', ' ');  // the lines of the code stay as they are
      if (!like.empty()) made += fmt::format("(__typeof__({}))", like);
    }
    made += code[i];
  }
  return made;
}

}  // namespace plchost::matiec
