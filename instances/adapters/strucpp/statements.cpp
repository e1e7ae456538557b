#include "instances/adapters/strucpp/statements.hpp"

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <optional>
#include <utility>

#include "instances/plc_debug.h"

namespace plchost::strucpp {

namespace {

constexpr std::string_view kLine = "#line ";
constexpr std::string_view kProgram = "Program_";
constexpr std::string_view kRun = "run";
constexpr std::string_view kOperator = "operator";
/// Of the name of the variable with the result.
constexpr std::string_view kResult = "_result";
constexpr std::size_t kMostPouName = 63;  // of a Plc_Pou

/// The head of a body.
struct Head {
  std::string_view pou;
  std::string_view type = {};    ///< its class; empty: a function
  std::string_view member = {};  ///< the method
  std::string_view parameters = {};

  [[nodiscard]] bool is_of_pou() const noexcept {
    return !type.empty() && (member == kRun || member == kOperator);
  }
};

// Between the last parentheses: those of an operator() are "()()".
std::string_view parameters_of(std::string_view line) {
  const std::size_t end = line.rfind(')');
  std::size_t begin = end;
  for (int depth = 0; end != std::string_view::npos && begin > 0; --begin) {
    if (line[begin] == ')') ++depth;
    if (line[begin] == '(' && --depth == 0) return line.substr(begin + 1, end - begin - 1);
  }
  return {};
}

// "void Program_MAIN::run() {", "IEC_INT COUNTER::RESET(IEC_INT TO) {", "IEC_INT TWICE(IEC_INT X) {"
std::optional<Head> head_of(std::string_view line) {
  const std::size_t end = line.find('(');
  if (line.empty() || line.front() == ' ' || end == std::string_view::npos || !line.ends_with('{'))
    return std::nullopt;
  std::string_view name = line.substr(0, end);
  name.remove_prefix(name.find_last_of(' ') + 1);
  const std::size_t scope = name.find("::");
  Head head{.pou = name, .parameters = parameters_of(line)};
  if (scope == std::string_view::npos) return head;
  head.member = name.substr(scope + 2);
  head.type = name.substr(0, scope);
  head.pou = head.type;
  if (head.member == kRun && head.pou.starts_with(kProgram)) head.pou.remove_prefix(kProgram.size());
  return head;
}

// Behind "#line N" there may be the end of a block or a label, too.
bool is_statement(std::string_view line) {
  line.remove_prefix(std::min(line.find_first_not_of(' '), line.size()));
  return !line.starts_with('}') && !line.starts_with("case ") && !line.starts_with("default:") &&
         !line.starts_with(kLine);
}

class Instrumenter {
 public:
  Instrumenter(const iec::Project& project, const CppValues& values) : project_(project), values_(values) {}

  DebugCode run(std::span<const std::string> codes) {
    for (const std::string& code : codes) {
      made_.texts.emplace_back();
      read(code);
      close();
    }
    return std::move(made_);
  }

 private:
  /// The body that the text is in.
  struct Body {
    const iec::Pou* pou = nullptr;
    bool is_member = false;
    std::size_t opened_at = 0;            // behind its brace
    std::optional<std::size_t> number;    // of its DebugPou, behind its first statement
    std::vector<iec::DebugLocal> locals;  // before that
    std::size_t first_local = 0;          // in its DebugPou, behind that
    unsigned first_line = 0;              // of its statements
    unsigned last_line = 0;
  };

  void read(std::string_view code) {
    std::string_view before;  // the line before, if it is a #line
    while (!code.empty()) {
      const std::size_t end = std::min(code.find('\n'), code.size());
      const std::string_view line = code.substr(0, end);
      if (body_ && !before.empty() && is_statement(line)) add_statement(before);
      if (!before.empty()) write(before);
      before = line.starts_with(kLine) ? line : std::string_view();
      if (before.empty()) write(line);
      if (line.starts_with('}')) close();
      if (const auto head = head_of(line)) {
        open(*head);
      } else if (body_ && !body_->number && before.empty()) {
        add_local(line);
      }
      code.remove_prefix(std::min(end + 1, code.size()));
    }
    if (!before.empty()) write(before);
  }
  void write(std::string_view line) { made_.texts.back().append(line).append(1, '\n'); }

  void open(const Head& head) {
    const iec::Pou* const pou = project_.pou(head.pou);
    close();
    if (pou == nullptr || pou->place.file.empty() || pou->name.size() > kMostPouName) return;
    body_ = Body{.pou = pou,
                 .is_member = !head.type.empty(),
                 .opened_at = made_.texts.back().size(),
                 .number = std::nullopt,
                 .locals = {}};
    add_parameters(head.parameters);
    if (head.is_of_pou()) add_temporaries(*pou, std::string(head.type));
  }
  // Types may have commas between < and >.
  void add_parameters(std::string_view list) {
    int depth = 0;
    std::size_t begin = 0;
    for (std::size_t i = 0; i <= list.size(); ++i) {
      const char c = i == list.size() ? ',' : list[i];
      if (c == '<') ++depth;
      if (c == '>') --depth;
      if (c != ',' || (depth > 0 && i < list.size())) continue;
      add_local(list.substr(begin, i - begin));
      begin = i + 1;
    }
  }
  // They are members that no debugger sees otherwise.
  void add_temporaries(const iec::Pou& pou, const std::string& type) {
    for (const iec::Variable& variable : pou.variables) {
      if (variable.section != iec::Variable::Section::temporary) continue;
      if (const CppVariable* const member = values_.member(type, variable.member))
        values_.add(body_->locals, *member, variable.name);
    }
  }
  void add_local(std::string_view text) {
    const auto variable = CppVariable::parse(text);
    if (!variable) return;
    std::string name = variable->name;
    if (name.ends_with(kResult)) name.resize(name.size() - kResult.size());
    values_.add(body_->locals, *variable, values_.name_in_source(name));
  }
  // The methods of a block have local variables of their own, so each body has lines.
  void close() {
    if (body_ && body_->number && body_->pou->kind == iec::Pou::Kind::function_block) {
      auto& locals = made_.pous[*body_->number].locals;
      for (std::size_t i = 0; i < body_->locals.size(); ++i) {
        locals[body_->first_local + i].first_line = body_->first_line;
        locals[body_->first_local + i].last_line = body_->last_line;
      }
    }
    body_.reset();
  }

  // "#line N "FILE""
  void add_statement(std::string_view directive) {
    directive.remove_prefix(kLine.size());
    unsigned line = 0;
    std::from_chars(directive.data(), directive.data() + directive.size(), line);
    if (line == 0) return;
    if (!body_->number) enter();
    body_->first_line = body_->first_line == 0 ? line : std::min(body_->first_line, line);
    body_->last_line = std::max(body_->last_line, line);
    made_.pous[*body_->number].lines.push_back(line);
    made_.texts.back() += iec::debug_statement(line);
  }
  // Behind the local variables.
  void enter() {
    body_->number = number_of(*body_->pou);
    auto& locals = made_.pous[*body_->number].locals;
    body_->first_local = locals.size();
    body_->locals.resize(std::min(body_->locals.size(), PLC_MAX_POU_LOCALS - locals.size()));
    std::string& text = made_.texts.back();
    text.insert(
        body_->locals.empty() ? body_->opened_at : text.size(),
        iec::debug_enter(*body_->number, body_->is_member ? "this" : "0", body_->locals, body_->first_local));
    locals.insert(locals.end(), body_->locals.begin(), body_->locals.end());
  }
  // The methods of a function block are parts of it.
  std::size_t number_of(const iec::Pou& pou) {
    const auto known = std::ranges::find(made_.pous, pou.name, &iec::DebugPou::name);
    if (known != made_.pous.end()) return static_cast<std::size_t>(known - made_.pous.begin());
    made_.pous.push_back({.name = pou.name, .file = pou.place.file, .lines = {}});
    return made_.pous.size() - 1;
  }

  const iec::Project& project_;
  const CppValues& values_;
  DebugCode made_;
  std::optional<Body> body_;
};

}  // namespace

DebugCode with_statements(std::span<const std::string> codes, const iec::Project& project,
                          const CppValues& values) {
  return Instrumenter(project, values).run(codes);
}

}  // namespace plchost::strucpp
