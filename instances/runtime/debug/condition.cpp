#include "instances/runtime/debug/condition.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <utility>

#include <fmt/format.h>

#include "shm/base/names.hpp"
#include "shm/variables/variable_symbol.hpp"

namespace plchost {

namespace {

constexpr std::string_view kAllowed =
    "allowed are VARIABLE = VALUE with =, <>, <, <=, > and >=, variables of type BOOL, NOT, AND, OR and "
    "parentheses";

std::unexpected<Error> bad_condition(std::string_view what) {
  return failure(ErrorCode::invalid_argument, fmt::format("condition: {}; {}", what, kAllowed));
}

// Words, operators, parentheses. A word ends at a space, an operator or a parenthesis, unless it is in
// quotes.
std::vector<std::string_view> words_of(std::string_view text) {
  std::vector<std::string_view> words;
  const auto is_operator = [](char c) { return c == '=' || c == '<' || c == '>'; };
  const auto is_in_word = [&](char c) { return !is_operator(c) && c != ' ' && c != '(' && c != ')'; };
  for (std::size_t at = 0; at < text.size();) {
    const char c = text[at];
    std::size_t end = at + 1;
    if (c == ' ' || c == '\t') {
      at = end;
      continue;
    }
    if (is_operator(c)) {
      while (end < text.size() && is_operator(text[end])) ++end;
    } else if (c != '(' && c != ')') {
      char quote = '\0';  // that the text is in, as ' of '='
      for (end = at; end < text.size() && (quote != '\0' || is_in_word(text[end])); ++end) {
        if (quote == '\0') {
          if (text[end] == '\'' || text[end] == '"') quote = text[end];
        } else if (text[end] == '$' && end + 1 < text.size()) {
          ++end;
        } else if (text[end] == quote) {
          quote = '\0';
        }
      }
    }
    words.push_back(text.substr(at, end - at));
    at = end;
  }
  return words;
}

bool begins_a_name(std::string_view word) noexcept {
  return !word.empty() &&
         (std::isalpha(static_cast<unsigned char>(word.front())) != 0 || word.front() == '_');
}

}  // namespace

class ConditionParser {
 public:
  ConditionParser(std::string_view text, const FindValue& find) : words_(words_of(text)), find_(find) {}

  Result<Condition> parse() {
    PLCHOST_TRY(either(0));
    if (at_ != words_.size()) return bad_condition(fmt::format("'{}' is not expected", shown(words_[at_])));
    return std::move(condition_);
  }

 private:
  using Kind = Condition::Kind;
  using Relation = Condition::Relation;

  [[nodiscard]] bool is_next(std::string_view word) const {
    return at_ < words_.size() && same_variable_name(words_[at_], word);
  }
  [[nodiscard]] bool take(std::string_view word) {
    if (!is_next(word)) return false;
    ++at_;
    return true;
  }

  Result<void> either(std::size_t depth) {
    PLCHOST_TRY(both(depth));
    while (take("OR")) {
      PLCHOST_TRY(both(depth));
      condition_.steps_.push_back({.kind = Kind::either});
    }
    return {};
  }

  Result<void> both(std::size_t depth) {
    PLCHOST_TRY(one(depth));
    while (take("AND") || take("&")) {
      PLCHOST_TRY(one(depth));
      condition_.steps_.push_back({.kind = Kind::both});
    }
    return {};
  }

  Result<void> one(std::size_t depth) {
    if (depth == Condition::kMaxDepth)
      return bad_condition(fmt::format("it is deeper than {} levels", Condition::kMaxDepth));
    if (take("NOT")) {
      PLCHOST_TRY(one(depth + 1));
      condition_.steps_.push_back({.kind = Kind::invert});
      return {};
    }
    if (take("(")) {
      PLCHOST_TRY(either(depth + 1));
      return take(")") ? Result<void>() : bad_condition("a ')' is missing");
    }
    return comparison();
  }

  Result<ValuePlace> variable(std::string_view name) {
    PLCHOST_TRY_ASSIGN(const auto place, find_(name));
    if (!is_string(place.type)) return place;
    return bad_condition(fmt::format("'{}' is a string, which cannot be compared", shown(name)));
  }

  Result<void> comparison() {
    if (at_ == words_.size()) return bad_condition("it ends too early");
    const auto name = words_[at_++];
    if (!begins_a_name(name)) return bad_condition(fmt::format("'{}' is no variable", shown(name)));
    PLCHOST_TRY_ASSIGN(const auto left, variable(name));
    static constexpr std::array kRelations = {
        std::pair("=", Relation::equal),   std::pair("<>", Relation::unequal),
        std::pair("<", Relation::less),    std::pair("<=", Relation::at_most),
        std::pair(">", Relation::greater), std::pair(">=", Relation::at_least)};
    const auto* const relation =
        std::ranges::find_if(kRelations, [&](const auto& row) { return is_next(row.first); });
    if (relation == kRelations.end()) {
      if (left.type != VariableType::bool_)
        return bad_condition(fmt::format("'{}' is no BOOL and is compared with nothing", shown(name)));
      condition_.steps_.push_back({.kind = Kind::truth, .left = left});
      return {};
    }
    ++at_;
    if (at_ == words_.size()) return bad_condition("it ends too early");
    return compare(left, relation->second, words_[at_++]);
  }

  // A word that is a value of the type is one, so TRUE is no variable.
  Result<void> compare(const ValuePlace& left, Relation relation, std::string_view word) {
    std::vector<std::byte> bytes(left.bytes);
    const auto parsed = parse_variable(left.type, word, bytes);
    Condition::Step step{.kind = Kind::compare, .relation = relation, .left = left};
    if (parsed) {
      step.value = number_of(left.type, bytes);
    } else {
      if (!begins_a_name(word)) return parsed;
      PLCHOST_TRY_ASSIGN(step.right, variable(word));
      step.with_variable = true;
    }
    condition_.steps_.push_back(step);
    return {};
  }

  std::vector<std::string_view> words_;
  const FindValue& find_;
  std::size_t at_ = 0;
  Condition condition_;
};

Result<Condition> Condition::parse(std::string_view text, const FindValue& find) {
  if (text.size() > kMaxText)
    return bad_condition(fmt::format("it has {} characters; at most {} are allowed", text.size(), kMaxText));
  return ConditionParser(text, find).parse();
}

bool Condition::compare(const Step& step, const Plc_Frame& frame) noexcept {
  const DebugNumber left = number_of(step.left.type, step.left.read(frame));
  const DebugNumber right =
      step.with_variable ? number_of(step.right.type, step.right.read(frame)) : step.value;
  switch (step.relation) {
    case Relation::equal:
      return left == right;
    case Relation::unequal:
      return left != right;
    case Relation::less:
      return left < right;
    case Relation::at_most:
      return left <= right;
    case Relation::greater:
      return left > right;
    case Relation::at_least:
      return left >= right;
  }
  return false;
}

// Each operand takes a character at least, so the stack has room for all.
bool Condition::holds(const Plc_Frame& frame) const noexcept {
  std::array<bool, kMaxText> stack{};
  std::size_t size = 0;
  for (const Step& step : steps_) {
    switch (step.kind) {
      case Kind::truth:
        stack[size++] = number_of(step.left.type, step.left.read(frame)) != 0;
        break;
      case Kind::compare:
        stack[size++] = compare(step, frame);
        break;
      case Kind::invert:
        stack[size - 1] = !stack[size - 1];
        break;
      case Kind::both:
        --size;
        stack[size - 1] = stack[size - 1] && stack[size];
        break;
      case Kind::either:
        --size;
        stack[size - 1] = stack[size - 1] || stack[size];
        break;
    }
  }
  return size == 1 && stack[0];
}

}  // namespace plchost
