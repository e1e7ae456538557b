#include "instances/adapters/matiec/iec2c.hpp"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <ranges>
#include <regex>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "instances/adapters/iec/environment.hpp"
#include "instances/adapters/iec/tokens.hpp"

namespace plchost::matiec {

namespace {

namespace fs = std::filesystem;

bool is_there(const fs::path& path) {
  std::error_code error;
  return fs::exists(path, error);
}

/// The folders of a compiler, if this is one: as MATIEC is built, and as it is installed.
std::optional<Compiler> compiler_of(const fs::path& program) {
  if (!is_there(program)) return std::nullopt;
  const fs::path folder = program.parent_path();
  for (const fs::path& library :
       {folder / "lib", folder.parent_path() / "lib" / "matiec",
        folder.parent_path() / "share" / "matiec" / "lib", folder.parent_path() / "lib"}) {
    for (const fs::path& headers : {library / "C", folder.parent_path() / "include" / "matiec"}) {
      if (is_there(library / "ieclib.txt") && is_there(headers / "iec_std_lib.h")) {
        return Compiler{.program = program, .library = library, .headers = headers};
      }
    }
  }
  return std::nullopt;
}

constexpr std::size_t kMaxLine = 4096;  // the library's expressions need more stack for longer ones

// Names are compared by the case of the library's texts, which is upper.
struct Declared {
  std::string name;
  std::string written;
  iec::SourcePlace place;
};
std::vector<Declared> declared_names(const iec::Project& project) {
  std::vector<Declared> names;
  for (const iec::Pou& pou : project.pous) names.push_back({iec::folded(pou.name), pou.name, pou.name_place});
  for (const iec::DeclaredType& type : project.types)
    names.push_back({iec::folded(type.name), type.name, type.place});
  return names;
}

/// The words of a line of the compiler's library.
std::vector<std::string> words_in(const std::string& file, unsigned line) {
  std::ifstream stream(file);
  std::string text;
  for (unsigned i = 0; i < line && std::getline(stream, text); ++i) {
  }
  std::vector<std::string> words;
  for (const iec::Token& token : iec::tokens_of(text, file).all) {
    if (token.kind == iec::Token::Kind::name) words.push_back(iec::folded(token.text));
  }
  return words;
}

void add_pous_in(const fs::path& file, std::set<std::string>& names) {
  std::ifstream stream(file);
  const std::string text{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  const iec::Tokens tokens = iec::tokens_of(text, file);
  for (std::size_t i = 0; i + 1 < tokens.all.size(); ++i) {
    if (tokens.all[i].is("FUNCTION") || tokens.all[i].is("FUNCTION_BLOCK"))
      names.insert(iec::folded(tokens.all[i + 1].text));
  }
}

// GATE : ( OPEN , CLOSED )
bool is_enumeration(const iec::DeclaredType& type) {
  return type.definition.starts_with(iec::folded(type.name) + " : (");
}

/// The values of an enumeration, where they are declared.
std::vector<iec::Token> values_of(const iec::DeclaredType& type, std::span<const iec::Source> sources) {
  std::vector<iec::Token> values;
  const auto source = std::ranges::find(sources, type.place.file, &iec::Source::file);
  if (source == sources.end()) return values;
  std::vector<iec::Token> tokens = iec::tokens_of(source->text, source->file).all;
  std::erase_if(tokens, [](const iec::Token& one) { return one.kind == iec::Token::Kind::pragma; });
  auto token = std::ranges::find(tokens, type.place, &iec::Token::place);
  token = std::find_if(token, tokens.end(), [](const iec::Token& one) { return one.is("("); });
  for (; token != tokens.end() && !token->is(")"); ++token) {
    const bool begins = token->is("(") || token->is(",");
    if (begins && std::next(token)->kind == iec::Token::Kind::name) values.push_back(*std::next(token));
  }
  return values;
}

std::string taken_text(std::string_view name) {
  return fmt::format("'{}' is also a name in the library of iec2c; choose another one", name);
}

unsigned number_of(const std::ssub_match& match) {
  return static_cast<unsigned>(std::strtoul(match.str().c_str(), nullptr, 10));
}

struct Message {
  [[nodiscard]] bool is_of_program() const { return fs::path(file).filename() == kJoinedFile; }

  std::string file;
  unsigned line;
  unsigned column;
  bool is_warning;
  std::string text;
};

std::vector<Message> messages_in(std::string_view output) {
  static const std::regex form(
      R"(^(.*?):(\d+)-(\d+)\.\.\d+-\d+: (error|warning)(?: while generating C code)?: (.*)$)");
  std::vector<Message> messages;
  for (const auto part : std::views::split(output, '\n')) {
    const std::string line(part.begin(), part.end());
    std::smatch match;
    if (line.size() > kMaxLine || !std::regex_match(line, match, form)) continue;
    messages.push_back({match[1], number_of(match[2]), number_of(match[3]), match[4] == "warning", match[5]});
  }
  return messages;
}

void add_once(iec::SourceProblem problem, iec::SourceProblems& problems) {
  if (std::ranges::find(problems, problem) == problems.end()) problems.push_back(std::move(problem));
}

}  // namespace

Result<Compiler> find_compiler(const std::string& folder) {
  const std::string chosen = folder.empty() ? iec::environment("PLCHOST_MATIEC") : folder;
  if (!chosen.empty()) {
    for (const fs::path& program :
         {fs::path(chosen) / "iec2c", fs::path(chosen) / "bin" / "iec2c", fs::path(chosen)}) {
      if (auto found = compiler_of(program)) return *std::move(found);
    }
    return failure(
        ErrorCode::not_found,
        fmt::format("there is no built MATIEC (iec2c, lib/ieclib.txt, lib/C) in {}; build it there: "
                    "autoreconf -i && ./configure && make",
                    chosen));
  }
  for (const fs::path& program : iec::in_path("iec2c")) {
    if (auto found = compiler_of(program)) return *std::move(found);
  }
  return failure(
      ErrorCode::not_found,
      "MATIEC was not found. Build it (github.com/beremiz/matiec), and name its folder by --matiec or "
      "PLCHOST_MATIEC");
}

std::vector<std::string> known_options(std::string_view help, std::string_view letters) {
  std::vector<std::string> options;
  for (const char letter : letters) {
    if (help.contains(fmt::format("\n -{} : ", letter))) options.push_back(fmt::format("-{}", letter));
  }
  return options;
}

std::set<std::string> names_of_library(const std::string& library) {
  std::set<std::string> names;
  std::error_code none;  // without the folder iec2c says so
  for (const fs::directory_entry& entry : fs::directory_iterator(library, none)) {
    if (entry.path().extension() == ".txt") add_pous_in(entry.path(), names);
  }
  return names;
}

iec::SourceProblems taken_names(const iec::Project& project, const std::string& library) {
  const std::set<std::string> taken = names_of_library(library);
  iec::SourceProblems problems;
  for (const iec::Pou& pou : project.pous) {
    if (taken.contains(iec::folded(pou.name))) problems.push_back({pou.name_place, taken_text(pou.name)});
  }
  return problems;
}

iec::SourceProblems taken_variables(const iec::Project& project, std::span<const iec::Source> sources,
                                    const std::string& library) {
  const std::set<std::string> taken = names_of_library(library);
  iec::SourceProblems problems;
  const auto check = [&](const std::string& name, const iec::SourcePlace& place) {
    if (taken.contains(iec::folded(name))) problems.push_back({place, taken_text(name)});
  };
  const auto check_all = [&](const std::vector<iec::Variable>& variables) {
    for (const iec::Variable& variable : variables) check(variable.name, variable.place);
  };
  for (const iec::Pou& pou : project.pous) check_all(pou.variables);
  for (const iec::Configuration& configuration : project.configurations) {
    check_all(configuration.globals);
    for (const iec::Resource& resource : configuration.resources) check_all(resource.globals);
  }
  for (const iec::DeclaredType& type : project.types) {
    check(type.name, type.place);
    if (!is_enumeration(type)) continue;
    for (const iec::Token& value : values_of(type, sources)) check(value.text, value.place);
  }
  return problems;
}

iec::SourceProblems problems_of(std::string_view output, const JoinedSource& source,
                                const iec::Project& project, const std::string& library) {
  iec::SourceProblems problems;
  const std::vector<Declared> names = declared_names(project);
  for (const Message& message : messages_in(output)) {
    if (message.is_warning) continue;
    if (message.is_of_program()) {
      add_once({source.place(message.line, message.column), message.text}, problems);
      continue;
    }
    for (const std::string& word : words_in(fs::path(library) / message.file, message.line)) {
      const auto declared = std::ranges::find(names, word, &Declared::name);
      if (declared == names.end()) continue;
      add_once(
          {declared->place, taken_text(declared->written) + ", or declare each POU and type before its use"},
          problems);
    }
  }
  return problems;
}

iec::SourceProblems remarks_of(std::string_view output, const JoinedSource& source) {
  iec::SourceProblems remarks;
  for (const Message& message : messages_in(output)) {
    if (message.is_warning && message.is_of_program())
      add_once({source.place(message.line, message.column), "iec2c: " + message.text}, remarks);
  }
  return remarks;
}

}  // namespace plchost::matiec
