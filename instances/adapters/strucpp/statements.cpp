#include "instances/adapters/strucpp/statements.hpp"

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <optional>
#include <utility>

namespace plchost::strucpp {

namespace {

constexpr std::string_view kLine = "#line ";
constexpr std::string_view kProgram = "Program_";
constexpr std::size_t kMostPouName = 63;  // of a Plc_Pou

/// The head of a body.
struct Head {
  std::string_view pou;
  bool is_member = false;
};

// "void Program_MAIN::run() {", "IEC_INT COUNTER::RESET(IEC_INT TO) {", "IEC_INT TWICE(IEC_INT X) {"
std::optional<Head> head_of(std::string_view line) {
  const std::size_t end = line.find('(');
  if (line.empty() || line.front() == ' ' || end == std::string_view::npos || !line.ends_with('{'))
    return std::nullopt;
  std::string_view name = line.substr(0, end);
  name.remove_prefix(name.find_last_of(' ') + 1);
  const std::size_t scope = name.find("::");
  if (scope == std::string_view::npos) return Head{.pou = name};
  const std::string_view member = name.substr(scope + 2);
  name = name.substr(0, scope);
  if (member == "run" && name.starts_with(kProgram)) name.remove_prefix(kProgram.size());
  return Head{.pou = name, .is_member = true};
}

// Behind "#line N" there may be the end of a block or a label, too.
bool is_statement(std::string_view line) {
  line.remove_prefix(std::min(line.find_first_not_of(' '), line.size()));
  return !line.starts_with('}') && !line.starts_with("case ") && !line.starts_with("default:") &&
         !line.starts_with(kLine);
}

class Instrumenter {
 public:
  explicit Instrumenter(const iec::Project& project) : project_(project) {}

  DebugCode run(std::span<const std::string> codes) {
    for (const std::string& code : codes) {
      made_.texts.emplace_back();
      body_.reset();
      read(code);
    }
    return std::move(made_);
  }

 private:
  /// The body that the text is in.
  struct Body {
    const iec::Pou* pou = nullptr;
    bool is_member = false;
    std::size_t opened_at = 0;          // behind its brace
    std::optional<std::size_t> number;  // of its DebugPou, behind its first statement
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
      if (line.starts_with('}')) body_.reset();
      if (const auto head = head_of(line)) open(*head);
      code.remove_prefix(std::min(end + 1, code.size()));
    }
    if (!before.empty()) write(before);
  }
  void write(std::string_view line) { made_.texts.back().append(line).append(1, '\n'); }

  void open(const Head& head) {
    const iec::Pou* const pou = project_.pou(head.pou);
    body_.reset();
    if (pou == nullptr || pou->place.file.empty() || pou->name.size() > kMostPouName) return;
    body_ = Body{.pou = pou,
                 .is_member = head.is_member,
                 .opened_at = made_.texts.back().size(),
                 .number = std::nullopt};
  }

  // The compiler names its first source in each "#line N "FILE"".
  void add_statement(std::string_view directive) {
    directive.remove_prefix(kLine.size());
    unsigned line = 0;
    std::from_chars(directive.data(), directive.data() + directive.size(), line);
    if (line == 0) return;
    if (!body_->number) {
      body_->number = number_of(*body_->pou);
      made_.texts.back().insert(body_->opened_at,
                                iec::debug_enter(*body_->number, body_->is_member ? "this" : "0"));
    }
    made_.pous[*body_->number].lines.push_back(line);
    made_.texts.back() += iec::debug_statement(line);
  }
  // The methods of a function block are parts of it.
  std::size_t number_of(const iec::Pou& pou) {
    const auto known = std::ranges::find(made_.pous, pou.name, &iec::DebugPou::name);
    if (known != made_.pous.end()) return static_cast<std::size_t>(known - made_.pous.begin());
    made_.pous.push_back({.name = pou.name, .file = pou.place.file, .lines = {}});
    return made_.pous.size() - 1;
  }

  const iec::Project& project_;
  DebugCode made_;
  std::optional<Body> body_;
};

}  // namespace

DebugCode with_statements(std::span<const std::string> codes, const iec::Project& project) {
  return Instrumenter(project).run(codes);
}

}  // namespace plchost::strucpp
