#include "instances/adapters/iec/project.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "instances/adapters/iec/duration.hpp"
#include "instances/adapters/iec/tokens.hpp"

namespace plchost::iec {

namespace {

constexpr std::int64_t kMostPriority = 31;
constexpr std::size_t kMostTasks = 1024;  // PLC_MAX_TASKS

struct SectionWord {
  std::string_view word;
  Variable::Section section;
};
constexpr std::array<SectionWord, 9> kSections{{{"VAR", Variable::Section::local},
                                                {"VAR_INPUT", Variable::Section::input},
                                                {"VAR_OUTPUT", Variable::Section::output},
                                                {"VAR_IN_OUT", Variable::Section::in_out},
                                                {"VAR_TEMP", Variable::Section::temporary},
                                                {"VAR_EXTERNAL", Variable::Section::external},
                                                {"VAR_GLOBAL", Variable::Section::global},
                                                {"VAR_ACCESS", Variable::Section::other},
                                                {"VAR_CONFIG", Variable::Section::other}}};

/// One file after the other into one project. A declaration that it does not understand is reported, and
/// reading goes on behind it.
class ProjectReader {
 public:
  void read(const Source& source) {
    Tokens tokens = tokens_of(source.text, source.file);
    problems_.insert(problems_.end(), tokens.problems.begin(), tokens.problems.end());
    for (const Token& token : tokens.all) note(token);
    std::erase_if(tokens.all, [](const Token& token) { return token.kind == Token::Kind::pragma; });
    tokens_ = std::move(tokens.all);
    next_ = 0;
    while (!at_end()) read_top();
  }
  ReadProject result() && { return {std::move(project_), std::move(problems_)}; }

 private:
  [[nodiscard]] const Token& token() const noexcept { return tokens_[next_]; }
  [[nodiscard]] bool at_end() const noexcept { return token().kind == Token::Kind::end; }
  [[nodiscard]] bool at(std::string_view word) const noexcept { return token().is(word); }
  const Token& take() noexcept { return at_end() ? token() : tokens_[next_++]; }
  bool take(std::string_view word) noexcept {
    if (!at(word)) return false;
    take();
    return true;
  }
  bool expect(std::string_view word, std::string_view where) {
    if (take(word)) return true;
    report(token().place, fmt::format("'{}' is missing {}", word, where));
    return false;
  }
  std::string take_name(std::string_view what) {
    if (token().kind == Token::Kind::name) return take().text;
    report(token().place, fmt::format("the name of {} is missing", what));
    return "";
  }
  void note(const Token& token) {
    if (token.kind == Token::Kind::place) project_.locations.try_emplace(folded(token.text), token.place);
    if (token.kind == Token::Kind::pragma && folded(token.text).starts_with("{#INCLUDE"))
      report(token.place, "{#include}: give the other file to the build as one of its sources instead");
  }
  /// False: the file has ended before.
  bool take_end(std::string_view word, std::string_view what, const SourcePlace& begin) {
    if (take(word)) return true;
    if (at_end()) report(begin, fmt::format("{} has no {} in this file", what, word));
    return at_end();
  }
  void report(const SourcePlace& place, std::string text) { problems_.push_back({place, std::move(text)}); }
  /// Behind the next such word; the text may end before.
  void skip_past(std::string_view word) {
    while (!at_end() && !take(word)) take();
  }

  void read_top() {
    if (at("PROGRAM")) return read_pou(Pou::Kind::program, "END_PROGRAM");
    if (at("FUNCTION_BLOCK")) return read_pou(Pou::Kind::function_block, "END_FUNCTION_BLOCK");
    if (at("FUNCTION")) return read_pou(Pou::Kind::function, "END_FUNCTION");
    if (at("CONFIGURATION")) return read_configuration();
    if (take("TYPE")) return read_types();
    take();
  }

  // Mode : (idle, busy); Point : STRUCT x : REAL; END_STRUCT;
  void read_types() {
    while (!at_end() && !take("END_TYPE")) {
      DeclaredType type{.name = token().text, .definition = "", .place = token().place};
      const bool is_named = token().kind == Token::Kind::name;
      for (int depth = 0; !at_end() && !at("END_TYPE"); take()) {
        type.definition += folded(token().text) + " ";
        if (at("STRUCT")) ++depth;
        if (at("END_STRUCT")) --depth;
        if (at(";") && depth <= 0) break;
      }
      if (is_named) project_.types.push_back(std::move(type));
      take(";");
    }
  }

  void read_pou(Pou::Kind kind, std::string_view end) {
    Pou pou{.kind = kind, .name = "", .variables = {}, .chart = "", .place = take().place};
    pou.name_place = token().place;
    pou.name = take_name("this POU");
    if (kind == Pou::Kind::function && at(":")) pou.result = tokens_[next_ + 1].text;
    while (!take_end(end, pou.name, pou.place)) {
      if (const SectionWord* const section = section_here()) {
        read_section(section->section, pou.variables);
      } else {
        read_statement(pou);
      }
    }
    if (project_.pou(pou.name) != nullptr)
      report(pou.place, fmt::format("there are two POUs '{}'", pou.name));
    project_.add(std::move(pou));
  }

  // A word of it. Of a chart the elements are told.
  void read_statement(Pou& pou) {
    constexpr std::array<std::string_view, 4> kElements{"INITIAL_STEP", "STEP", "TRANSITION", "ACTION"};
    const bool is_element = std::ranges::any_of(kElements, [&](std::string_view word) { return at(word); });
    const bool is_first = at("INITIAL_STEP");
    const std::string word = folded(take().text);
    if (is_first || (is_element && !pou.chart.empty())) pou.chart += word + " " + folded(token().text) + "; ";
  }

  [[nodiscard]] const SectionWord* section_here() const noexcept {
    const auto* const found =
        std::ranges::find_if(kSections, [&](const SectionWord& section) { return at(section.word); });
    return found == kSections.end() ? nullptr : found;
  }

  // iec2c drops the first one in silence, and does not end at the other.
  void refuse_section() {
    constexpr const char* kConfig =
        "VAR_CONFIG is not carried out; write the initial value, or the location, where the variable is "
        "declared, and remove this section";
    constexpr const char* kAccess =
        "VAR_ACCESS is not carried out; remove this section, as clients see the variables of programs, and "
        "globals, by their own names";
    report(token().place, at("VAR_CONFIG") ? kConfig : kAccess);
    skip_past("END_VAR");
  }

  void read_section(Variable::Section section, std::vector<Variable>& variables) {
    if (section == Variable::Section::other) return refuse_section();
    Variable begin{.name = "", .type = "", .location = "", .section = section, .place = take().place};
    for (;;) {
      if (take("RETAIN")) {
        begin.retain = true;
      } else if (take("CONSTANT")) {
        begin.constant = true;
      } else if (at("PERSISTENT") && !is_declared_here()) {
        project_.persistent.push_back(take().place);
      } else if (!take("NON_RETAIN")) {
        break;
      }
    }
    while (!at_end() && !take("END_VAR")) read_declaration(begin, variables);
  }

  // IEC 61131-3 does not reserve each word that a section can have: it may be the name of a variable.
  [[nodiscard]] bool is_declared_here() const noexcept {
    const Token& behind = at_end() ? token() : tokens_[next_ + 1];
    return behind.is(":") || behind.is(",") || behind.is("AT");
  }

  // a, b AT %IX0.0 : ARRAY [1..3] OF INT := [1, 2, 3];
  void read_declaration(const Variable& begin, std::vector<Variable>& variables) {
    const std::size_t first = variables.size();
    do {
      Variable variable = begin;
      variable.place = token().place;
      if (token().kind == Token::Kind::name && !at("AT")) variable.name = take().text;
      if (take("AT")) {
        if (token().kind == Token::Kind::place) variable.location = folded(take().text);
        if (variable.name.empty())
          report(variable.place, variable.location.empty()
                                     ? "'AT' is a word of the language; choose another name"
                                     : fmt::format("{}: write a name before AT", variable.location));
      }
      variables.push_back(std::move(variable));
    } while (take(","));
    const std::string type = take(":") ? take_type() : "";
    // The compiler says more of a declaration that cannot be read.
    if (type.empty() && !at_end() && !at(";") && !at("END_VAR")) take();
    std::string value;
    (void)take(":=");
    while (!at_end() && !at(";") && !at("END_VAR")) value += take().text;
    take(";");
    for (std::size_t i = first; i < variables.size(); ++i) {
      variables[i].type = type;
      if (variables[i].constant) variables[i].value = value;
    }
  }
  std::string take_type() {
    std::string type;
    while (!at_end() && !at(";") && !at(":=") && !at("END_VAR")) {
      const std::string& word = take().text;
      const bool joined = type.empty() || type.ends_with('[') || type.ends_with('(') ||
                          type.ends_with("..") || word == "[" || word == "]" || word == "(" || word == ")" ||
                          word == ".." || word == ",";
      type += (joined ? "" : " ") + word;
    }
    return type;
  }

  void read_configuration() {
    Configuration configuration{.name = "", .globals = {}, .resources = {}, .place = take().place};
    configuration.name = take_name("this CONFIGURATION");
    Resource own{.name = "", .globals = {}, .tasks = {}, .programs = {}, .place = configuration.place};
    while (!take_end("END_CONFIGURATION", configuration.name, configuration.place)) {
      if (at("RESOURCE")) {
        configuration.resources.push_back(read_resource());
      } else {
        read_member(own, configuration.globals);
      }
    }
    if (!own.tasks.empty() || !own.programs.empty()) configuration.resources.push_back(std::move(own));
    for (Resource& resource : configuration.resources) check(resource);
    project_.configurations.push_back(std::move(configuration));
  }

  Resource read_resource() {
    Resource resource{.name = "", .globals = {}, .tasks = {}, .programs = {}, .place = take().place};
    resource.name = take_name("this RESOURCE");
    if (take("ON")) take();
    while (!at("END_CONFIGURATION") && !take_end("END_RESOURCE", resource.name, resource.place))
      read_member(resource, resource.globals);
    return resource;
  }

  void read_member(Resource& resource, std::vector<Variable>& globals) {
    if (const SectionWord* const section = section_here()) {
      read_section(section->section, globals);
    } else if (at("TASK")) {
      read_task(resource);
    } else if (at("PROGRAM")) {
      read_program(resource);
    } else if (!take(";")) {
      const Token& wrong = take();
      report(wrong.place, fmt::format("'{}' is not expected here; allowed are TASK, PROGRAM, VAR_GLOBAL, "
                                      "RESOURCE and the end of the configuration",
                                      wrong.text));
      skip_past(";");
    }
  }

  // TASK fast (SINGLE := start, INTERVAL := T#10ms, PRIORITY := 1);
  void read_task(Resource& resource) {
    Task task{.name = "", .interval_ns = {}, .single = "", .priority = -1, .place = take().place};
    task.name = take_name("this TASK");
    if (!expect("(", fmt::format("behind TASK {}", task.name))) return skip_past(";");
    while (!at_end() && !at(")") && !at(";")) {
      const Token key = take();
      if (!expect(":=", fmt::format("behind {}", key.text))) break;
      const Token value = take_value();
      set(task, key, value);
      if (!take(",")) break;
    }
    expect(")", fmt::format("at the end of TASK {}", task.name));
    take(";");
    if (task.priority < 0)
      report(task.place, fmt::format("TASK {} has no PRIORITY; 0 to 31 is allowed", task.name));
    resource.tasks.push_back(std::move(task));
  }
  /// A name may have members: instance.output.
  Token take_value() {
    Token value = take();
    while (take(".")) value.text += "." + take().text;
    return value;
  }
  void set(Task& task, const Token& key, const Token& value) {
    if (key.is("SINGLE")) {
      if (value.kind != Token::Kind::name) {
        report(value.place, fmt::format("SINGLE {}: allowed is the name of a variable", value.text));
      }
      task.single = value.text;
    } else if (key.is("PRIORITY")) {
      std::int64_t priority = -1;
      const char* const end = value.text.data() + value.text.size();
      if (std::from_chars(value.text.data(), end, priority).ptr != end || priority < 0 ||
          priority > kMostPriority) {
        report(value.place, fmt::format("PRIORITY {}: allowed is 0 (the highest) to 31", value.text));
      }
      task.priority = static_cast<int>(std::clamp<std::int64_t>(priority, 0, kMostPriority));
    } else if (key.is("INTERVAL")) {
      const auto interval = nanoseconds_of(value.text);
      if (!interval) report(value.place, fmt::format("INTERVAL {}", interval.error()));
      if (interval && *interval < 0) report(value.place, fmt::format("INTERVAL {} is below 0", value.text));
      if (interval && *interval > 0) task.interval_ns = *interval;
    } else {
      report(key.place,
             fmt::format("'{}' is no part of a TASK; allowed are SINGLE, INTERVAL and PRIORITY", key.text));
    }
  }

  // PROGRAM RETAIN main WITH fast : Main (in := start);
  void read_program(Resource& resource) {
    Program program{.name = "", .type = "", .task = "", .place = take().place};
    program.retain = take("RETAIN");
    take("NON_RETAIN");
    program.name = take_name("this instance of a PROGRAM");
    if (take("WITH")) program.task = take_name(fmt::format("the task of {}", program.name));
    if (expect(":", fmt::format("before the type of {}", program.name))) {
      program.type = take_name(fmt::format("the type of {}", program.name));
    }
    program.connected = at("(");
    skip_past(";");
    resource.programs.push_back(std::move(program));
  }

  void check(Resource& resource) {
    if (resource.tasks.size() > kMostTasks) {
      report(resource.tasks[kMostTasks].place, fmt::format("a RESOURCE has at most {} TASKs", kMostTasks));
      resource.tasks.resize(kMostTasks);
      return;
    }
    std::set<std::string> names;
    for (const Task& task : resource.tasks) {
      if (!names.insert(folded(task.name)).second)
        report(task.place, fmt::format("there are two TASKs '{}'", task.name));
    }
    for (const Program& program : resource.programs) {
      if (!program.task.empty() && !names.contains(folded(program.task))) {
        report(program.place,
               fmt::format("PROGRAM {} runs WITH '{}', and there is no such TASK in its resource",
                           program.name, program.task));
      }
    }
  }

  std::vector<Token> tokens_;
  std::size_t next_ = 0;
  Project project_;
  SourceProblems problems_;
};

}  // namespace

const Pou* Project::pou(std::string_view name) const {
  const auto found = numbers_.find(folded(name));
  return found == numbers_.end() ? nullptr : &pous[found->second];
}

void Project::add(Pou pou) {
  numbers_.try_emplace(folded(pou.name), pous.size());
  pous.push_back(std::move(pou));
}

ReadProject read_project(std::span<const Source> sources) {
  ProjectReader reader;
  for (const Source& source : sources) reader.read(source);
  return std::move(reader).result();
}

}  // namespace plchost::iec
