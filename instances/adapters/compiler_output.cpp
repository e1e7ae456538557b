#include "instances/adapters/compiler_output.hpp"

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <ranges>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "instances/adapters/iec/c_texts.hpp"
#include "instances/adapters/iec/tokens.hpp"
#include "shm/base/trimmed.hpp"

namespace plchost {

namespace {

constexpr std::string_view kError = "error: ";
constexpr std::string_view kNeeds = "required from";
constexpr std::string_view kExpands = "note: in expansion of macro";
constexpr std::size_t kMostProblems = 20;
constexpr std::string_view kBlanks = " \t\r";

/// FILE:LINE:COLUMN: REST, or FILE:LINE: REST.
struct Line {
  std::string file;
  unsigned line = 0;
  std::string_view rest;
};

/// A number and a colon, which are taken from the text.
std::optional<unsigned> take_number(std::string_view& text) {
  unsigned number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  const auto length = static_cast<std::size_t>(end - text.data());
  if (error != std::errc() || !text.substr(length).starts_with(':')) return std::nullopt;
  text.remove_prefix(length + 1);
  return number;
}

std::optional<Line> line_of(std::string_view text) {
  for (std::size_t colon = text.find(':'); colon != std::string_view::npos;
       colon = text.find(':', colon + 1)) {
    std::string_view rest = text.substr(colon + 1);
    const auto number = take_number(rest);
    if (!number) continue;
    (void)take_number(rest);
    rest.remove_prefix(std::min(rest.find_first_not_of(' '), rest.size()));
    return Line{.file = std::string(text.substr(0, colon)), .line = *number, .rest = rest};
  }
  return std::nullopt;
}

/// The text of an error; empty: the line tells something else.
std::string_view text_of_error(std::string_view rest) {
  constexpr std::string_view kFatal = "fatal ";
  if (rest.starts_with(kFatal)) rest.remove_prefix(kFatal.size());
  return rest.starts_with(kError) ? rest.substr(kError.size()) : std::string_view();
}

/// Each line of a compiler's output with a place.
class ErrorReader {
 public:
  explicit ErrorReader(const FindSource& find_source) : find_source_(find_source) {}

  void take(const Line& line) {
    if (problems_.size() >= kMostProblems) return;
    if (line.rest.starts_with(kNeeds)) {
      if (auto source = find_source_(line.file, line.line)) needed_by_ = std::move(source);
    } else if (line.rest.starts_with(kExpands)) {
      if (!unplaced_.empty()) add(find_source_(line.file, line.line));
    } else if (const std::string_view text = text_of_error(line.rest); !text.empty()) {
      unplaced_ = text;
      auto source = find_source_(line.file, line.line);
      add(source ? std::move(source) : std::move(needed_by_));
      needed_by_.reset();
    }
  }
  [[nodiscard]] iec::SourceProblems problems() && { return std::move(problems_); }

 private:
  void add(std::optional<FoundSource> source) {
    if (!source) return;
    std::string text = std::exchange(unplaced_, "");
    if (!source->subject.empty()) text = fmt::format("{}: {}", source->subject, text);
    if (!source->advice.empty()) text += "; " + source->advice;
    iec::SourceProblem problem{std::move(source->place), std::move(text)};
    if (std::ranges::find(problems_, problem) == problems_.end()) problems_.push_back(std::move(problem));
  }

  const FindSource& find_source_;
  iec::SourceProblems problems_;
  std::optional<FoundSource> needed_by_;  // of the template of which an error follows
  std::string unplaced_;                  // an error whose place may follow
};

/// The place of this name as a whole word.
std::size_t find_word(std::string_view text, std::string_view name) {
  for (std::size_t at = text.find(name); at != std::string_view::npos; at = text.find(name, at + 1)) {
    const std::size_t end = at + name.size();
    if ((at == 0 || !iec::is_of_name(text[at - 1])) && (end == text.size() || !iec::is_of_name(text[end])))
      return at;
  }
  return std::string_view::npos;
}

/// Of a byte of the token.
iec::SourcePlace place_in(const iec::Token& token, std::size_t offset) {
  iec::SourcePlace place = token.place;
  const std::string_view before = std::string_view(token.text).substr(0, offset);
  const std::size_t line = before.rfind('\n') + 1;  // 0: there is none
  place.line += static_cast<unsigned>(std::ranges::count(before, '\n'));
  place.column = (line == 0 ? place.column : 1) + iec::characters_in(before.substr(line));
  return place;
}

std::vector<iec::Token> pragmas_in(const iec::Source& source) {
  std::vector<iec::Token> tokens = iec::tokens_of(source.text, source.file).all;
  std::erase_if(tokens, [](const iec::Token& token) { return token.kind != iec::Token::Kind::pragma; });
  return tokens;
}

/// Without its braces.
std::string_view code_in(const iec::Token& pragma) {
  const std::string_view text = pragma.text;
  const std::size_t braces = text.starts_with("{{") ? 2 : 1;
  return text.size() < 2 * braces ? "" : text.substr(braces, text.size() - 2 * braces);
}

}  // namespace

iec::SourceProblems problems_of_compiler(std::string_view output, const FindSource& find_source) {
  ErrorReader reader(find_source);
  for (const auto part : std::views::split(output, '\n')) {
    if (const auto line = line_of(std::string_view(part.begin(), part.end()))) reader.take(*line);
  }
  return std::move(reader).problems();
}

std::string_view from_first_error(std::string_view output) {
  for (std::size_t begin = 0; begin < output.size();) {
    const std::size_t end = std::min(output.find('\n', begin), output.size());
    const auto line = line_of(output.substr(begin, end - begin));
    if (line && !text_of_error(line->rest).empty()) return output.substr(begin);
    begin = end + 1;
  }
  return output;
}

std::string undefined_symbol(std::string_view output) {
  constexpr std::string_view kBegin = "undefined symbol: ";
  const std::size_t at = output.find(kBegin);
  if (at == std::string_view::npos) return "";
  const std::string_view rest = output.substr(at + kBegin.size());
  return {rest.begin(), std::ranges::find_if_not(rest, iec::is_of_name)};
}

iec::SourceProblems pragmas_with(std::string_view name, std::span<const iec::Source> sources) {
  iec::SourceProblems problems;
  if (name.empty()) return problems;
  for (const iec::Source& source : sources) {
    for (const iec::Token& pragma : pragmas_in(source)) {
      const std::size_t at = find_word(pragma.text, name);
      if (at == std::string_view::npos) continue;
      problems.push_back({place_in(pragma, at),
                          fmt::format("the C in this pragma uses {}, which plchost does not have", name)});
    }
  }
  return problems;
}

std::optional<iec::SourcePlace> place_in_pragma(std::string_view line_of_c,
                                                std::span<const iec::Source> sources) {
  std::optional<iec::SourcePlace> found;
  const std::string_view wanted = trimmed(line_of_c, kBlanks);
  if (wanted.empty()) return found;
  for (const iec::Source& source : sources) {
    for (const iec::Token& pragma : pragmas_in(source)) {
      for (const auto part : std::views::split(code_in(pragma), '\n')) {
        if (trimmed(std::string_view(part.begin(), part.end()), kBlanks) != wanted) continue;
        if (found) return std::nullopt;
        found = place_in(pragma, static_cast<std::size_t>(&*part.begin() - pragma.text.data()));
        found->column = 0;
      }
    }
  }
  return found;
}

}  // namespace plchost
