#include <algorithm>
#include <cstring>
#include <iterator>
#include <optional>
#include <set>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "instances/adapters/iec/c_texts.hpp"
#include "instances/adapters/iec/pragmas.hpp"
#include "instances/adapters/iec/tokens.hpp"
#include "instances/adapters/matiec/complements.hpp"
#include "instances/adapters/matiec/constant_bounds.hpp"
#include "instances/adapters/matiec/declared.hpp"
#include "instances/adapters/matiec/explained.hpp"
#include "instances/adapters/matiec/glue.hpp"
#include "instances/adapters/matiec/iec2c.hpp"
#include "instances/adapters/matiec/initial_values.hpp"
#include "instances/adapters/matiec/located.hpp"
#include "instances/adapters/matiec/loops.hpp"
#include "instances/adapters/matiec/references.hpp"
#include "instances/adapters/matiec/refused.hpp"
#include "instances/adapters/matiec/statements.hpp"
#include "instances/adapters/matiec/temporaries.hpp"
#include "instances/adapters/matiec/unknown_values.hpp"
#include "instances/adapters/matiec/uses.hpp"
#include "instances/adapters/translator.hpp"

namespace plchost {

namespace {

constexpr const char* kConfigurationFile = "plchost_configuration.c";
constexpr const char* kCode = "POUS.c";
constexpr std::string_view kTextMacro = "__STRING_LITERAL(";

class MatiecTranslator : public Translator {
 public:
  explicit MatiecTranslator(BuildContext& context) : context_(context) {}

  [[nodiscard]] iec::Compiler compiler() const noexcept override { return iec::Compiler::matiec; }

  bool read() override {
    auto [project, problems] = iec::read_project(context_.sources);
    context_.project = std::move(project);
    std::ranges::move(problems, std::back_inserter(context_.report.problems));
    context_.refuse_persistent(context_.project, "MATIEC");
    std::ranges::move(iec::idle_pragmas(context_.sources), std::back_inserter(context_.report.remarks));
    std::ranges::move(matiec::refused_words(context_.sources), std::back_inserter(context_.report.problems));
    std::ranges::move(matiec::refused_names(context_.project), std::back_inserter(context_.report.problems));
    if (context_.good()) {
      // A block of methods only has no variables either.
      auto refused = matiec::refused_pous(context_.project, context_.sources);
      if (!refused.empty())
        refused = matiec::explained(std::move(refused), context_.sources, context_.project);
      std::ranges::move(refused, std::back_inserter(context_.report.problems));
    }
    if (context_.good() && context_.project.configurations.size() == 1) {
      check_file_names();
      std::ranges::move(matiec::blank_unused_pragmas(context_.sources),
                        std::back_inserter(context_.report.remarks));
    }
    matiec::resolve_bounds(context_.project);
    matiec::mark_references(context_.project);
    // Errors of the sources count more than a configuration that is missing.
    if (context_.good() && context_.project.configurations.empty() &&
        matiec::find_compiler(context_.order.matiec)) {
      (void)translate_sources();
    }
    return context_.good();
  }

  bool translate() override {
    return translate_sources() && read_located() && mend_initial_values() &&
           (context_.order.debug ? instrument() : drop_directives());
  }

  [[nodiscard]] iec::Glue glue(const iec::Resource& resource) override {
    return matiec::write_glue(context_.project, configuration(), resource, located_, pous_);
  }

  bool compile(const std::string& name, const std::string& glue, const std::filesystem::path& made) override {
    const std::string file = name + ".c";
    if (!context_.has(context_.folder().write(file, "#include \"plchost_library.h\"\n" + glue))) return false;
    const std::string adapters = context_.adapters();
    std::vector<std::string> sources = context_.application_files();
    sources.insert(sources.begin(), {file, kConfigurationFile});
    return context_.compile(
        "the C compiler", words_,
        {.sources = std::move(sources),
         .folders = {adapters, adapters + "/application", adapters + "/matiec",
                     std::filesystem::absolute(compiler_.headers)},
         .output = made},
        [this](const std::string& named, unsigned line) { return source_of(named, line); });
  }

 private:
  bool translate_sources() {
    auto compiler = matiec::find_compiler(context_.order.matiec);
    auto words = context_.words_of("CC", "cc");
    if (!context_.has(compiler) || !words || !context_.open_folder()) return false;
    compiler_ = *std::move(compiler);
    words_ = *std::move(words);
    std::ranges::move(matiec::taken_names(context_.project, compiler_.library),
                      std::back_inserter(context_.report.problems));
    if (!context_.good()) return false;
    joined_.emplace(context_.sources);
    return context_.has(context_.folder().write(std::string(matiec::kJoinedFile), joined_->text())) && run();
  }

  // Of the C that is copied from a pragma, else of the statement or the declaration that a line of C is made
  // from.
  [[nodiscard]] std::optional<FoundSource> source_of(const std::string& file, unsigned line) const {
    const std::string name = std::filesystem::path(file).filename();
    if (name != kCode) {
      const auto code = context_.folder().read(name);
      return code && !name.starts_with("plchost_") ? declaration_of(*code, line) : std::nullopt;
    }
    if (auto place = place_in_pragma(matiec::line_in(code_, line), context_.sources))
      return FoundSource{*std::move(place)};
    const unsigned joined = matiec::joined_line_of(code_, line);
    if (joined != 0) return FoundSource{joined_->place(joined, 0)};
    return declaration_of(code_, line);
  }
  [[nodiscard]] std::optional<FoundSource> declaration_of(const std::string& code, unsigned line) const {
    auto found = matiec::declared_in(code, line, context_.project);
    if (!found) return std::nullopt;
    return FoundSource{.place = std::move(found->place),
                       .subject = std::move(found->what),
                       .advice = "iec2c makes this C of it: declare it in another way, or use STruC++"};
  }

  [[nodiscard]] const iec::Configuration& configuration() const {
    return context_.project.configurations.front();
  }

  // iec2c makes a file of each of these names. The files of the library are found by name, too.
  void check_file_names() {
    std::vector<std::string> names{"POUS", "LOCATED_VARIABLES", "IEC_STD_LIB", "ACCESSOR"};
    const auto check = [&](const char* kind, const std::string& given, const iec::SourcePlace& place) {
      const std::string name = iec::folded(given);
      if (std::ranges::find(names, name) != names.end() || name.starts_with("PLCHOST_")) {
        context_.fail({place, fmt::format("{} {}: a file of the build or another RESOURCE has this name; "
                                          "choose another one",
                                          kind, given)});
      }
      names.push_back(name);
    };
    check("CONFIGURATION", configuration().name, configuration().place);
    for (const iec::Resource& resource : configuration().resources)
      check("RESOURCE", resource.name, resource.place);
  }

  bool run() {
    namespace fs = std::filesystem;
    std::vector<std::string> command{fs::absolute(compiler_.program), "-f", "-l"};
    if (!add_options(command)) return false;
    command.insert(command.end(), {"-O", "l", "-I", fs::absolute(compiler_.library), "-T", ".",
                                   std::string(matiec::kJoinedFile)});
    const auto end = translated_by(command);
    if (!end) return false;
    if (!end->success()) {
      std::ranges::move(matiec::taken_variables(context_.project, context_.sources, compiler_.library),
                        std::back_inserter(context_.report.problems));
    }
    std::ranges::move(matiec::remarks_of(end->output, *joined_), std::back_inserter(context_.report.remarks));
    auto problems = matiec::problems_of(end->output, *joined_, context_.project, compiler_.library);
    if (!end->success())
      problems = matiec::explained(std::move(problems), context_.sources, context_.project);
    std::ranges::move(problems, std::back_inserter(context_.report.problems));
    if (context_.good() && !end->success()) {
      std::ranges::move(matiec::unknown_values(context_.sources, context_.project),
                        std::back_inserter(context_.report.problems));
    }
    if (context_.good() && end->signal != 0) {
      context_.fail(
          fmt::format("iec2c was ended by SIG{}, and has not said which line it could not translate",
                      ::sigabbrev_np(end->signal)));
    } else if (context_.good() && end->exit_code != 0) {
      context_.fail("iec2c has failed:" + first_lines(end->output));
    }
    return context_.good() && context_.has(context_.folder().check_room());
  }

  // With -p, iec2c knows POUs and types before their declaration. It then reads its own library with their
  // names, too, and takes its variables M, P, IN and others for them. So it gets -p only if it needs to.
  std::optional<ProgramEnd> translated_by(const std::vector<std::string>& command) {
    const auto run_with = [&](std::vector<std::string> words, bool looks_ahead) {
      if (looks_ahead) words.insert(words.begin() + 1, "-p");
      return context_.run("iec2c", words, context_.order.translate_limit);
    };
    if (!matiec::declares_before_use(context_.sources)) return run_with(command, true);
    auto end = run_with(command, false);
    if (!end || end->success()) return end;
    auto other = run_with(command, true);
    return !other || other->success() ? other : end;
  }

  // Of references and of bounds that are constants, if this iec2c knows them. References take the words REF,
  // DREF and NULL from programs without any.
  bool add_options(std::vector<std::string>& command) {
    const auto help = context_.run("iec2c", {command.front(), "-h"}, context_.order.translate_limit);
    if (!help) return false;
    std::ranges::move(matiec::known_options(help->output, "a"), std::back_inserter(command));
    const iec::SourcePlace reference = matiec::first_reference(context_.sources);
    if (reference.file.empty()) return true;
    const auto options = matiec::known_options(help->output, "rR");
    if (options.empty())
      context_.fail({reference, "REF_TO: this iec2c knows no references; use a newer MATIEC, or STruC++"});
    std::ranges::copy(options, std::back_inserter(command));
    const std::set<std::string> library = matiec::names_of_library(compiler_.library);
    std::ranges::move(
        matiec::references_to_blocks(context_.project, context_.sources,
                                     [&](const std::string& name) { return library.contains(name); }),
        std::back_inserter(context_.report.problems));
    return context_.good();
  }

  bool read_located() {
    auto located = context_.folder().read("LOCATED_VARIABLES.h");
    if (!located) {
      context_.fail("iec2c has not done its work: " + located.error().describe());
      return false;
    }
    located_ = matiec::located_variables(*located);
    return context_.has(context_.folder().write(
        kConfigurationFile,
        fmt::format("#include \"plchost_library.h\"\n#include \"{}.c\"\n", configuration().name)));
  }

  // Of globals.
  bool mend_initial_values() {
    std::vector<std::string> files{configuration().name + ".c"};
    for (const iec::Resource& resource : configuration().resources)
      files.push_back((resource.name.empty() ? "RESOURCE" : resource.name) + ".c");
    return context_.rewrite(files, [](const std::string& code) {
      return matiec::with_marked_initial_values(iec::with_ended_escapes(code, kTextMacro));
    });
  }

  // Of the program, as iec2c should have written it.
  [[nodiscard]] std::optional<std::string> read_code() {
    const auto code = context_.folder().read(kCode);
    if (!context_.has(code)) return std::nullopt;
    const std::string mended =
        matiec::with_reference_assignments(matiec::with_narrow_complements(matiec::with_first_turns(*code)));
    return matiec::with_marked_initial_values(
        matiec::with_temporary_values(iec::with_ended_escapes(mended, kTextMacro), context_.project));
  }

  bool drop_directives() {
    const auto code = read_code();
    if (!code) return false;
    code_ = matiec::without_directives(*code);
    return context_.has(context_.folder().replace(kCode, code_));
  }

  bool instrument() {
    const auto code = read_code();
    if (!code) return false;
    auto made = matiec::with_statements(
        *code, *joined_, context_.project,
        [this](std::string_view file, unsigned line) { return context_.projects.line_in_file(file, line); });
    for (iec::DebugPou& pou : made.pous) {
      if (const iec::Pou* const known = context_.project.pou(pou.name)) pou.name = known->name;
    }
    pous_ = std::move(made.pous);
    code_ = std::move(made.text);
    return context_.has(context_.folder().replace(kCode, code_)) &&
           context_.has(context_.folder().write(std::string(iec::kDebugFile), iec::debug_header(pous_)));
  }

  BuildContext& context_;
  std::string code_;                 // of the program, as the C compiler gets it
  std::vector<iec::DebugPou> pous_;  // of a debug build
  matiec::Compiler compiler_;
  std::optional<matiec::JoinedSource> joined_;
  std::vector<std::string> words_;
  std::vector<matiec::Located> located_;
};

}  // namespace

std::unique_ptr<Translator> make_matiec_translator(BuildContext& context) {
  return std::make_unique<MatiecTranslator>(context);
}

}  // namespace plchost
