#include "instances/adapters/iec/tokens.hpp"

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "shm/base/utf8.hpp"

namespace plchost::iec {

namespace {

bool is_letter(char c) noexcept {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
}
/// Of a sign in UTF-8 that is not ASCII.
bool is_foreign(char c) noexcept {
  return static_cast<unsigned char>(c) >= 0x80;
}
bool is_digit(char c) noexcept {
  return c >= '0' && c <= '9';
}
char upper(char c) noexcept {
  return c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
}
bool same(std::string_view a, std::string_view b) noexcept {
  return std::ranges::equal(a, b, [](char x, char y) { return upper(x) == upper(y); });
}

/// Dates and times of day have '-' and ':' between their numbers.
bool is_date(std::string_view type) noexcept {
  constexpr std::array<std::string_view, 12> kDates{"D",   "DATE",          "LD",   "LDATE",
                                                    "DT",  "DATE_AND_TIME", "LDT",  "LDATE_AND_TIME",
                                                    "TOD", "TIME_OF_DAY",   "LTOD", "LTIME_OF_DAY"};
  return std::ranges::any_of(kDates, [&](std::string_view date) { return same(date, type); });
}

constexpr std::size_t kMostForeign = 20;  // problems; a file that is no text has no more

class Reader {
 public:
  Reader(std::string_view text, const std::string& file) : text_(text), position_(byte_order_mark(text)) {
    place_ = {file, 1, 1};
  }

  Tokens read() {
    while (skip_blanks()) tokens_.all.push_back(next());
    tokens_.all.push_back({.kind = Token::Kind::end, .text = "", .place = place_, .offset = position_});
    return std::move(tokens_);
  }

 private:
  [[nodiscard]] char at(std::size_t ahead = 0) const noexcept {
    return position_ + ahead < text_.size() ? text_[position_ + ahead] : '\0';
  }
  [[nodiscard]] bool at_end() const noexcept { return position_ >= text_.size(); }
  [[nodiscard]] bool begins(std::string_view word) const noexcept {
    return text_.substr(position_).starts_with(word);
  }
  void step(std::size_t count = 1) {
    for (; count > 0 && !at_end(); --count) {
      if (text_[position_++] == '\n') {
        ++place_.line;
        place_.column = 1;
      } else if (!continues_utf8(text_[position_ - 1])) {
        ++place_.column;
      }
    }
  }
  template <class Predicate>
  void step_while(Predicate belongs) {
    while (!at_end() && belongs(at())) step();
  }

  /// False: the text has ended.
  bool skip_blanks() {
    for (;;) {
      step_while([](char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; });
      if (begins("(*")) {
        skip_old_comment();
      } else if (begins("/*") || begins("//")) {
        const std::size_t begin = position_;
        if (begins("/*")) {
          skip_comment("*/");
        } else {
          step_while([](char c) { return c != '\n'; });
        }
        tokens_.new_comments.push_back({begin, position_ - begin});
      } else {
        return !at_end();
      }
    }
  }
  // The second edition ends a comment at the first "*)", the third one counts those that begin within. A
  // comment is of the third one if its own end would have no begin in the second one.
  void skip_old_comment() {
    if (!std::exchange(knows_nested_, true)) find_nested();
    const auto nested = std::ranges::lower_bound(nested_, position_, {}, &Stretch::offset);
    if (nested == nested_.end() || nested->offset != position_) return skip_comment("*)");
    tokens_.new_comments.push_back(*nested);
    step(nested->bytes);
  }
  void find_nested() {
    const std::vector<std::size_t> strays = ends_without_begin();
    std::vector<std::size_t> open;
    for (std::size_t at = position_; at + 1 < text_.size() && !strays.empty(); ++at) {
      const std::string_view two = text_.substr(at, 2);
      if (two == "(*") {
        open.push_back(at++);
      } else if (two == "*)") {
        if (!open.empty()) {
          if (std::ranges::binary_search(strays, at)) nested_.push_back({open.back(), at + 2 - open.back()});
          open.pop_back();
        }
        ++at;
      }
    }
    std::ranges::sort(nested_, {}, &Stretch::offset);
  }
  // Each "*)" outside of comments and texts, as the second edition reads them.
  [[nodiscard]] std::vector<std::size_t> ends_without_begin() const {
    std::vector<std::size_t> ends;
    const auto behind = [&](std::string_view end, std::size_t at) {
      return std::min(text_.find(end, at), text_.size()) + end.size();
    };
    for (std::size_t at = position_; at + 1 < text_.size();) {
      const std::string_view two = text_.substr(at, 2);
      if (two == "(*") {
        at = behind("*)", at + 2);
      } else if (two == "/*") {
        at = behind("*/", at + 2);
      } else if (two == "//") {
        at = behind("\n", at);
      } else if (two == "*)") {
        ends.push_back(at);
        at += 2;
      } else if (two[0] == '\'' || two[0] == '"') {
        const char quote = text_[at++];
        while (at < text_.size() && text_[at] != quote && text_[at] != '\n') at += text_[at] == '$' ? 2U : 1U;
        ++at;
      } else {
        ++at;
      }
    }
    return ends;
  }
  void skip_comment(std::string_view end) {
    const SourcePlace begin = place_;
    step(2);
    while (!at_end() && !begins(end)) step();
    if (at_end()) tokens_.problems.push_back({begin, fmt::format("this comment has no '{}'", end)});
    step(end.size());
  }

  Token next() {
    const SourcePlace place = place_;
    const std::size_t begin = position_;
    const Token::Kind kind = read_one();
    return {.kind = kind,
            .text = std::string(text_.substr(begin, position_ - begin)),
            .place = place,
            .offset = begin};
  }
  Token::Kind read_one() {
    if (is_letter(at())) return read_name();
    if (is_digit(at())) return read_number();
    if (at() == '\'' || at() == '"') return read_text();
    if (at() == '%') return read_location();
    if (at() == '{') return read_pragma();
    if (is_foreign(at())) return read_foreign();
    constexpr std::array<std::string_view, 8> kPairs{":=", "=>", "..", "<=", ">=", "<>", "**", "?="};
    const auto pair = std::ranges::find_if(kPairs, [&](std::string_view two) { return begins(two); });
    step(pair == kPairs.end() ? 1 : 2);
    return Token::Kind::symbol;
  }
  Token::Kind read_foreign() {
    if (tokens_.problems.size() < kMostForeign) {
      tokens_.problems.push_back({place_,
                                  "this letter is not ASCII; outside of comments and texts there are only "
                                  "A to Z, digits, _ and the signs of the language"});
    }
    step_while(is_foreign);
    return Token::Kind::symbol;
  }
  Token::Kind read_name() {
    const std::size_t begin = position_;
    step_while([](char c) { return is_letter(c) || is_digit(c); });
    if (at() != '#') return Token::Kind::name;
    const bool date = is_date(text_.substr(begin, position_ - begin));
    step();
    if (at() == '-' || at() == '+') step();
    step_while([&](char c) {
      return is_letter(c) || is_digit(c) || c == '.' || c == '#' || (date && (c == '-' || c == ':'));
    });
    return Token::Kind::literal;
  }
  Token::Kind read_number() {
    // A range has two points behind its first number: 1..10.
    while (is_letter(at()) || is_digit(at()) || at() == '#' || (at() == '.' && is_digit(at(1)))) {
      const bool exponent = at() == 'e' || at() == 'E';
      step();
      if (exponent && (at() == '-' || at() == '+')) step();
    }
    return Token::Kind::number;
  }
  Token::Kind read_text() {
    const SourcePlace begin = place_;
    const char quote = at();
    step();
    while (!at_end() && at() != quote && at() != '\n') step(at() == '$' && at(1) != '\n' ? 2 : 1);
    if (at() != quote) tokens_.problems.push_back({begin, fmt::format("this text has no second {}", quote)});
    if (at() == quote) step();
    return Token::Kind::text;
  }
  Token::Kind read_location() {
    step();
    step_while([](char c) { return is_letter(c) || is_digit(c) || c == '.' || c == '*'; });
    return Token::Kind::place;
  }
  Token::Kind read_pragma() {
    const SourcePlace begin = place_;
    const std::string_view close = begins("{{") ? "}}" : "}";
    while (!at_end() && !begins(close)) step();
    if (at_end()) tokens_.problems.push_back({begin, fmt::format("this pragma has no '{}'", close)});
    step(close.size());
    return Token::Kind::pragma;
  }

  std::string_view text_;
  std::size_t position_ = 0;
  SourcePlace place_;
  bool knows_nested_ = false;
  std::vector<Stretch> nested_;  // by their offset
  Tokens tokens_;
};

}  // namespace

bool Token::is(std::string_view word) const noexcept {
  return (kind == Kind::name || kind == Kind::symbol) && same(text, word);
}

std::size_t byte_order_mark(std::string_view text) noexcept {
  constexpr std::string_view kMark = "\xEF\xBB\xBF";
  return text.starts_with(kMark) ? kMark.size() : 0;
}

unsigned characters_in(std::string_view text) noexcept {
  return static_cast<unsigned>(std::ranges::count_if(text, [](char c) { return !continues_utf8(c); }));
}

std::string folded(std::string_view name) {
  std::string result(name);
  std::ranges::transform(result, result.begin(), upper);
  return result;
}

Tokens tokens_of(std::string_view text, const std::string& file) {
  return Reader(text, file).read();
}

std::string describe(const SourceProblem& problem) {
  const SourcePlace& place = problem.place;
  std::string where = place.file;
  if (place.line != 0) where += fmt::format(":{}", place.line);
  if (place.column != 0) where += fmt::format(":{}", place.column);
  return where.empty() ? problem.text : fmt::format("{}: {}", where, problem.text);
}

}  // namespace plchost::iec
