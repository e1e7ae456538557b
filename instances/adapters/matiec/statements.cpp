#include "instances/adapters/matiec/statements.hpp"

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <optional>
#include <ranges>

#include <fmt/format.h>

#include "instances/adapters/matiec/symbols.hpp"

namespace plchost::matiec {

namespace {

constexpr std::string_view kBodyEnd = "_body__(";
constexpr std::string_view kLine = "#line ";
constexpr std::string_view kComment = "/* line ";
constexpr std::string_view kFunction = "// FUNCTION";
/// Behind the variables of a function, and before each statement.
constexpr std::string_view kControl = "  // Control execution";

// Behind these words; 0: there is none.
unsigned number_behind(std::string_view words, std::string_view line) {
  unsigned number = 0;
  if (line.starts_with(words)) std::from_chars(line.data() + words.size(), line.data() + line.size(), number);
  return number;
}

// The last word before the first parenthesis.
std::string_view name_before_parenthesis(std::string_view line) {
  line = line.substr(0, line.find('('));
  return line.substr(line.find_last_of(' ') + 1);
}

class Instrumenter {
 public:
  Instrumenter(std::string_view code, const JoinedSource& source, const iec::Project& project,
               const iec::FindLine& find_line)
      : code_(code), source_(source), project_(project), find_line_(find_line) {}

  DebugCode run() {
    made_.text = fmt::format("#include \"{}\"\n", iec::kDebugFile);
    while (!code_.empty()) {
      const std::size_t end = std::min(code_.find('\n'), code_.size());
      take(code_.substr(0, end));
      code_.remove_prefix(std::min(end + 1, code_.size()));
    }
    return std::move(made_);
  }

 private:
  void take(std::string_view line) {
    if (line.starts_with(kLine)) return take_statement(number_behind(kLine, line));
    if (line == kFunction) {
      function_follows_ = true;
    } else if (function_follows_ && line.find('(') != std::string_view::npos) {
      begin(name_before_parenthesis(line), "0");
      function_follows_ = false;
    } else if (const std::size_t body = line.find(kBodyEnd);
               body != std::string_view::npos && line.starts_with("void ") && line.ends_with('{')) {
      begin(line.substr(0, body).substr(std::string_view("void ").size()), "data__");
    }
    if (line == kControl && !declared_at_) declared_at_ = made_.text.size();
    made_.text += line;
    made_.text += '\n';
    if (!name_.empty() && !opened_at_ && line.ends_with('{')) opened_at_ = made_.text.size();
  }

  // The head of a function or of a body.
  void begin(std::string_view name, std::string_view self) {
    name_ = name;
    self_ = self;
    opened_at_.reset();
    declared_at_.reset();
    number_.reset();
  }

  // The statement of that line of the joined source follows. A POU with none stays as it is.
  void take_statement(unsigned joined) {
    const iec::SourcePlace place = source_.place(joined, 1);
    if (name_.empty() || !opened_at_ || joined == 0) return;
    if (!number_) {
      number_ = made_.pous.size();
      made_.pous.push_back({.name = name_, .file = place.file, .lines = {}});
      enter(made_.pous.back());
    }
    const unsigned line = find_line_(place.file, place.line);
    made_.pous[*number_].lines.push_back(line);
    made_.text += fmt::format("{}{} */\n{}", kComment, joined, iec::debug_statement(line));
  }

  // The local variables of a function are those of C, which stand before. Those of others are members.
  void enter(iec::DebugPou& pou) {
    const iec::Pou* const known = project_.pou(name_);
    const bool is_function = known != nullptr && known->kind == iec::Pou::Kind::function;
    if (known != nullptr && (!is_function || declared_at_)) pou.locals = locals_of(project_, *known);
    made_.text.insert(is_function ? declared_at_.value_or(*opened_at_) : *opened_at_,
                      iec::debug_enter(*number_, self_, pou.locals));
  }

  std::string_view code_;
  const JoinedSource& source_;
  const iec::Project& project_;
  const iec::FindLine& find_line_;
  DebugCode made_;
  bool function_follows_ = false;
  std::string name_;  // of the POU that the text is in; empty: none yet
  std::string self_;
  std::optional<std::size_t> opened_at_;    // behind its brace
  std::optional<std::size_t> declared_at_;  // behind its variables
  std::optional<std::size_t> number_;       // of its DebugPou
};

}  // namespace

std::string without_directives(std::string_view code) {
  std::string text;
  for (const auto part : std::views::split(code, '\n')) {
    const std::string_view line(part.begin(), part.end());
    const unsigned number = number_behind(kLine, line);
    text += number == 0 ? std::string(line) : fmt::format("{}{} */", kComment, number);
    text += '\n';
  }
  return text;
}

std::string_view line_in(std::string_view code, unsigned line) {
  for (; line > 1 && !code.empty(); --line)
    code.remove_prefix(std::min(code.find('\n'), code.size() - 1) + 1);
  return code.substr(0, code.find('\n'));
}

unsigned joined_line_of(std::string_view code, unsigned line) {
  unsigned joined = 0;
  for (const auto part : std::views::split(code, '\n') | std::views::take(line)) {
    const std::string_view text(part.begin(), part.end());
    if (text.starts_with('}')) joined = 0;  // the end of a body
    if (const unsigned number = number_behind(kComment, text); number != 0) joined = number;
  }
  return joined;
}

DebugCode with_statements(std::string_view code, const JoinedSource& source, const iec::Project& project,
                          const iec::FindLine& find_line) {
  return Instrumenter(code, source, project, find_line).run();
}

}  // namespace plchost::matiec
