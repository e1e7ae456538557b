// How names and patterns find variables in a SymbolTable.

#include <algorithm>
#include <charconv>
#include <iterator>
#include <optional>

#include <fmt/format.h>

#include "shm/base/names.hpp"
#include "shm/variables/indexed_name.hpp"
#include "shm/variables/symbol_page.hpp"

namespace plchost {

namespace {

using Places = std::array<std::uint32_t, kMaxVariableDimensions>;

/// A character of a name or of a pattern, or an index.
struct Token {
  enum class Kind : std::uint8_t { character, one, any, index };
  Kind kind = Kind::character;
  char character = 0;
  std::optional<std::int64_t> index = std::nullopt;  ///< nothing: each one
};

std::unexpected<Error> bad_index(std::string_view name) {
  return failure(
      ErrorCode::invalid_argument,
      fmt::format("'{}': an index is a number, as in Line.temperature[3] or Grid[1,2]", shown(name)));
}

/// "1,2]" of "Grid[1,2].x", and goes on behind it: a token for each index. "*", and nothing, mean each one.
bool take_indexes(std::string_view& rest, std::vector<Token>& tokens) {
  const std::size_t end = rest.find(']');
  if (end == std::string_view::npos) return false;
  std::string_view list = rest.substr(0, end);
  rest.remove_prefix(end + 1);
  for (;;) {
    const std::size_t comma = list.find(',');
    std::string_view text = list.substr(0, comma);
    while (text.starts_with(' ')) text.remove_prefix(1);
    while (text.ends_with(' ')) text.remove_suffix(1);
    Token token{.kind = Token::Kind::index};
    if (!text.empty() && text != "*") {
      std::int32_t number = 0;
      const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), number);
      if (error != std::errc() || stop != text.data() + text.size()) return false;
      token.index = number;
    }
    tokens.push_back(token);
    if (comma == std::string_view::npos) return true;
    list.remove_prefix(comma + 1);
  }
}

/// Nothing: an index is none.
std::optional<std::vector<Token>> tokens_of(std::string_view text) {
  std::vector<Token> tokens;
  while (!text.empty()) {
    const char c = text.front();
    text.remove_prefix(1);
    if (c == '[') {
      if (!take_indexes(text, tokens)) return std::nullopt;
    } else if (c == '*') {
      tokens.push_back({.kind = Token::Kind::any});
    } else {
      tokens.push_back({.kind = c == '?' ? Token::Kind::one : Token::Kind::character, .character = c});
    }
  }
  return tokens;
}

bool in_range(const VariableDimension& dimension, std::int64_t index) noexcept {
  return index >= dimension.first && index - dimension.first < dimension.count;
}

/// The number that an element has; the places are valid.
std::uint32_t element_of(const VariableSymbol& symbol, const Places& places) noexcept {
  std::uint32_t element = 0;
  for (std::size_t d = 0; d < symbol.dimensions.size(); ++d)
    element = element * symbol.dimensions[d].count + places.at(d);
  return element;
}

/// A variable that a pattern is compared with.
class Candidate {
 public:
  Candidate(const VariableSymbol& symbol, bool with_indexes) : symbol_(symbol) {
    for (std::size_t at = 0; at < symbol.name.size(); ++at) {
      if (symbol.name[at] != '[') {
        tokens_.push_back({.character = symbol.name[at]});
        continue;
      }
      if (with_indexes) tokens_.push_back({.kind = Token::Kind::index});
      ++at;
    }
  }

  /// Goes back to the last "*" only: that finds a match if there is one. The indexes that it names are in
  /// fixed().
  bool matches(const std::vector<Token>& pattern) {
    std::size_t p = 0;
    std::size_t t = 0;
    std::size_t star = pattern.size();
    std::size_t resumed = 0;
    while (t < tokens_.size()) {
      if (p < pattern.size() && pattern[p].kind == Token::Kind::any) {
        star = p++;
        resumed = t;
      } else if (p < pattern.size() && takes(pattern[p], t)) {
        ++p;
        ++t;
      } else if (star < pattern.size()) {
        p = star + 1;
        t = ++resumed;
        forget_from(t);
      } else {
        return false;
      }
    }
    while (p < pattern.size() && pattern[p].kind == Token::Kind::any) ++p;
    return p == pattern.size();
  }

  /// For each dimension the only place that the pattern means; nothing: all.
  [[nodiscard]] const std::array<std::optional<std::uint32_t>, kMaxVariableDimensions>& fixed()
      const noexcept {
    return fixed_;
  }

 private:
  [[nodiscard]] std::size_t dimension_at(std::size_t token) const noexcept {
    const auto end = tokens_.begin() + static_cast<std::ptrdiff_t>(token);
    return static_cast<std::size_t>(
        std::ranges::count(tokens_.begin(), end, Token::Kind::index, &Token::kind));
  }

  bool takes(const Token& wanted, std::size_t at) {
    const Token& is = tokens_[at];
    if (is.kind == Token::Kind::character) {
      return wanted.kind == Token::Kind::one ||
             (wanted.kind == Token::Kind::character &&
              same_variable_name({&wanted.character, 1}, {&is.character, 1}));
    }
    if (wanted.kind != Token::Kind::index) return false;
    const std::size_t dimension = dimension_at(at);
    auto& fixed = fixed_.at(dimension);
    fixed = std::nullopt;
    if (!wanted.index) return true;
    const VariableDimension& range = symbol_.dimensions[dimension];
    if (!in_range(range, *wanted.index)) return false;
    fixed = static_cast<std::uint32_t>(*wanted.index - range.first);
    return true;
  }

  void forget_from(std::size_t token) {
    for (std::size_t d = dimension_at(token); d < fixed_.size(); ++d) fixed_.at(d) = std::nullopt;
  }

  const VariableSymbol& symbol_;
  std::vector<Token> tokens_;
  std::array<std::optional<std::uint32_t>, kMaxVariableDimensions> fixed_{};
};

/// The elements that lie at the fixed places, ascending, at most `most`.
std::vector<std::uint32_t> elements_at(
    const VariableSymbol& symbol,
    const std::array<std::optional<std::uint32_t>, kMaxVariableDimensions>& fixed, std::size_t most) {
  std::vector<std::uint32_t> elements;
  Places places{};
  for (std::size_t d = 0; d < fixed.size(); ++d) places.at(d) = fixed.at(d).value_or(0);
  while (elements.size() < most) {
    elements.push_back(element_of(symbol, places));
    std::size_t d = symbol.dimensions.size();
    while (d-- > 0) {
      if (fixed.at(d)) continue;
      if (++places.at(d) < symbol.dimensions[d].count) break;
      places.at(d) = 0;
    }
    if (d >= symbol.dimensions.size()) break;  // all were counted through
  }
  return elements;
}

}  // namespace

std::vector<VariableSymbol>::const_iterator SymbolTable::find_place(std::string_view canonical) const {
  const auto before = [](std::string_view left, std::string_view right) {
    return compare_variable_names(left, right) < 0;
  };
  return std::ranges::lower_bound(symbols_, canonical, before, &VariableSymbol::name);
}

Result<IndexedName> IndexedName::parse(std::string_view name) {
  const auto tokens = tokens_of(name);
  if (!tokens) return bad_index(name);
  IndexedName indexed;
  for (const Token& token : *tokens) {
    if (token.kind == Token::Kind::index) {
      indexed.canonical += "[]";
      indexed.indexes.push_back(token.index);
    } else {
      indexed.canonical += token.kind == Token::Kind::any ? '*' : token.character;
    }
  }
  return indexed;
}

Result<std::uint32_t> element_number(const VariableSymbol& symbol, const IndexedName& indexed) {
  Places places{};
  for (std::size_t d = 0; d < indexed.indexes.size(); ++d) {
    const auto& index = indexed.indexes[d];
    const VariableDimension& dimension = symbol.dimensions[d];
    if (!index || !in_range(dimension, *index)) {
      return failure(ErrorCode::invalid_argument,
                     fmt::format("it is {}; allowed as index {} are {} to {}", type_text(symbol), d + 1,
                                 dimension.first, std::int64_t{dimension.first} + dimension.count - 1));
    }
    places.at(d) = static_cast<std::uint32_t>(*index - dimension.first);
  }
  return element_of(symbol, places);
}

bool same_without_brackets(std::string_view left, std::string_view right) noexcept {
  const auto next = [](std::string_view& text) {
    text.remove_prefix(std::min(text.find_first_not_of("[]"), text.size()));
    const std::string_view character = text.substr(0, 1);
    text.remove_prefix(character.size());
    return character;
  };
  for (;;) {
    const std::string_view character = next(left);
    if (!same_variable_name(character, next(right))) return false;
    if (character.empty()) return true;
  }
}

Error other_dimensions(std::string_view name, const VariableSymbol& symbol) {
  return {.code = ErrorCode::invalid_argument,
          .system_errno = 0,
          .message = fmt::format(
              "'{}': it is {}; name {}", shown(name), type_text(symbol),
              symbol.dimensions.empty() ? symbol.name : "an element, as " + element_name(symbol, 0))};
}

Result<VariableElement> SymbolTable::find(std::string_view name) const {
  PLCHOST_TRY_ASSIGN(const auto indexed, IndexedName::parse(name));
  const auto found = find_place(indexed.canonical);
  if (found == symbols_.end() || !same_variable_name(found->name, indexed.canonical))
    return not_found(name, indexed.canonical);
  auto element = element_number(*found, indexed);
  if (!element) return failure_in(fmt::format("'{}'", shown(name)), std::move(element).error());
  return VariableElement{.symbol = static_cast<std::uint32_t>(found - symbols_.begin()), .element = *element};
}

std::unexpected<Error> SymbolTable::not_found(std::string_view name, std::string_view canonical) const {
  for (const VariableSymbol& symbol : symbols_) {
    if (same_without_brackets(symbol.name, canonical)) return std::unexpected(other_dimensions(name, symbol));
  }
  const auto begins_with = [&](const std::string& prefix) -> const VariableSymbol* {
    const auto place = find_place(prefix);
    const bool does =
        place != symbols_.end() && same_variable_name(place->name.substr(0, prefix.size()), prefix);
    return does ? &*place : nullptr;
  };
  if (const auto* const member = begins_with(fmt::format("{}.", canonical)))
    return std::unexpected(
        has_members(name, fmt::format("{}{}", shown(name), member->name.substr(canonical.size()))));
  if (const auto* const member = begins_with(fmt::format("{}[", canonical)))
    return std::unexpected(has_members(name, element_name(*member, 0)));
  // Comparing takes its time: with the neighbours only.
  constexpr std::ptrdiff_t kNeighbours = 200;
  const auto place = find_place(canonical);
  const auto begin = place - std::min(kNeighbours, place - symbols_.begin());
  const auto end = place + std::min(kNeighbours, symbols_.end() - place);
  std::vector<std::string_view> known;
  std::ranges::transform(begin, end, std::back_inserter(known), &VariableSymbol::name);
  const std::string_view near = nearest_name(cut(canonical, kMaxVariableName), known);
  return failure(ErrorCode::not_found,
                 fmt::format("no variable '{}'{}", shown(name),
                             near.empty() ? "" : fmt::format(" (did you mean '{}'?)", near)));
}

std::vector<SymbolTable::Match> SymbolTable::match(std::string_view pattern, std::uint32_t from,
                                                   std::size_t most, std::size_t most_elements) const {
  std::vector<Match> found;
  const auto tokens = tokens_of(pattern);
  if (!tokens || pattern.size() > 2 * kMaxVariableName) return found;
  const bool with_indexes = pattern.find('[') != std::string_view::npos;
  for (std::size_t i = from; i < symbols_.size() && found.size() < most; ++i) {
    Candidate candidate(symbols_[i], with_indexes);
    if (!candidate.matches(*tokens)) continue;
    Match match{.symbol = static_cast<std::uint32_t>(i), .elements = {}};
    if (std::ranges::any_of(candidate.fixed(), [](const auto& place) { return place.has_value(); })) {
      match.elements = elements_at(symbols_[i], candidate.fixed(), most_elements);
      most_elements -= match.elements.size();
      if (match.elements.empty()) return found;
    }
    found.push_back(std::move(match));
  }
  return found;
}

}  // namespace plchost
