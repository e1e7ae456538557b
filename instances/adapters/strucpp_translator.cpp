#include <algorithm>
#include <cstring>
#include <iterator>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "instances/adapters/iec/c_texts.hpp"
#include "instances/adapters/iec/pragmas.hpp"
#include "instances/adapters/strucpp/compiler.hpp"
#include "instances/adapters/strucpp/glue.hpp"
#include "instances/adapters/strucpp/line_directives.hpp"
#include "instances/adapters/strucpp/plan_file.hpp"
#include "instances/adapters/strucpp/source_text.hpp"
#include "instances/adapters/strucpp/statements.hpp"
#include "instances/adapters/strucpp/temporaries.hpp"
#include "instances/adapters/translator.hpp"

namespace plchost {

namespace {

namespace fs = std::filesystem;

/// Its name for the compiler, which writes it between quotes into C++ as it is. Else a neutral one.
std::string name_for_compiler(const std::string& file, std::size_t number) {
  const std::string path = fs::absolute(file);
  const bool is_plain = std::ranges::all_of(
      path, [](char c) { return c >= ' ' && c <= '~' && c != '"' && c != '\\' && c != '?'; });
  return is_plain ? path : fmt::format("source_{}.st", number);
}

class StrucppTranslator : public Translator {
 public:
  explicit StrucppTranslator(BuildContext& context) : context_(context) {}

  [[nodiscard]] iec::Compiler compiler() const noexcept override { return iec::Compiler::strucpp; }

  // The compiler reads the declarations, too, so all of its work is done here.
  bool read() override {
    auto compiler = strucpp::find_compiler(context_.order.strucpp);
    if (!context_.has(compiler) || !context_.open_folder()) return false;
    compiler_ = *std::move(compiler);
    if (!write_order() || !run()) return false;
    const auto text = context_.folder().read("plan.json");
    if (!context_.has(text)) return false;
    std::vector<std::string> files;
    for (const iec::Source& source : context_.sources) files.push_back(source.file);
    auto plan = strucpp::read_plan(*text, files);
    if (!context_.has(plan)) return false;
    // A compiler that takes the word may do something else than it says.
    const iec::Project project = iec::read_project(context_.sources).project;
    context_.refuse_persistent(project, "STruC++");
    if (!plan->problems.empty()) explain(project);
    std::ranges::move(plan->problems, std::back_inserter(context_.report.problems));
    std::ranges::move(plan->remarks, std::back_inserter(context_.report.remarks));
    std::ranges::move(iec::idle_pragmas(context_.sources), std::back_inserter(context_.report.remarks));
    context_.project = std::move(plan->project);
    files_ = std::move(plan->files);
    symbols_ = std::move(plan->symbols);
    return context_.good();
  }

  bool translate() override {
    auto c = context_.words_of("CC", "cc");
    auto cpp = context_.words_of("CXX", "c++");
    if (!c || !cpp || !mend_code() || (context_.order.debug && !instrument()) || !renew_temporaries())
      return false;
    words_ = *std::move(cpp);
    find_flags();
    const std::string adapters = context_.adapters();
    return context_.compile("the C compiler", *std::move(c),
                            {.kind = CompileOrder::Kind::c_objects,
                             .sources = context_.application_files(),
                             .folders = {adapters, adapters + "/application"},
                             .output = ""},
                            [](const std::string&, unsigned) { return std::nullopt; });
  }

  [[nodiscard]] iec::Glue glue(const iec::Resource& resource) override {
    return strucpp::write_glue(context_.project, context_.project.configurations.front(), resource, files_,
                               symbols_, pous_);
  }

  bool compile(const std::string& name, const std::string& glue, const fs::path& made) override {
    const std::string file = name + ".cpp";
    if (!context_.has(context_.folder().write(file, glue))) return false;
    const std::string adapters = context_.adapters();
    std::vector<std::string> sources{file};
    for (const fs::path source : context_.application_files())
      sources.push_back(source.stem().string() + ".o");
    std::vector<std::string> folders{adapters + "/application", adapters + "/strucpp", compiler_.headers,
                                     context_.folder().path()};
    if (context_.order.debug) folders.push_back(adapters);  // plc_debug.h
    return context_.compile(
        "the C++ compiler", words_,
        {.kind = CompileOrder::Kind::cpp_application,
         .sources = std::move(sources),
         .folders = std::move(folders),
         .output = made,
         .flags = flags_},
        [this](const std::string& named, unsigned line) { return source_of(named, line); });
  }

 private:
  // By the name that the compiler was given.
  [[nodiscard]] const iec::Source* source_named(std::string_view file) const {
    for (std::size_t i = 0; i < context_.sources.size(); ++i) {
      if (file == name_for_compiler(context_.sources[i].file, i)) return &context_.sources[i];
    }
    return nullptr;
  }
  // The C++ has directives #line with those names, and with lines of the user's files.
  [[nodiscard]] std::optional<FoundSource> source_of(const std::string& file, unsigned line) const {
    const iec::Source* const source = source_named(file);
    if (source == nullptr) return std::nullopt;
    return FoundSource{{source->file, context_.projects.line_in_source(source->file, line), 0}};
  }

  // An online change allows no symbol that exists once in a process. Only g++ makes such, and has this flag.
  void find_flags() {
    const std::string flag = "-fno-gnu-unique";
    std::vector<std::string> probe = words_;
    probe.insert(probe.end(), {flag, "-fsyntax-only", "-x", "c++", "/dev/null"});
    const auto end = run_program(probe, context_.folder().path(), {.time = context_.order.translate_limit});
    if (end && end->success()) flags_.push_back(flag);
  }

  bool mend_code() {
    std::vector<std::string> files = files_;
    files.emplace_back("generated.hpp");
    const auto find_file = [this](std::string_view pou) { return file_of(pou); };
    const auto find_line = [this](std::string_view file, unsigned line) {
      const iec::Source* const source = source_named(file);
      return source == nullptr ? line : context_.projects.line_in_file(source->file, line);
    };
    return context_.rewrite(files, [&](const std::string& code) {
      return strucpp::with_files_of_pous(iec::with_ended_escapes(code), find_file, find_line);
    });
  }
  // As the compiler knows it.
  [[nodiscard]] std::optional<std::string> file_of(std::string_view pou) const {
    const iec::Pou* const known = context_.project.pou(pou);
    if (known == nullptr) return std::nullopt;
    for (std::size_t i = 0; i < context_.sources.size(); ++i) {
      const std::string& source = context_.sources[i].file;
      if (source == known->place.file) return name_for_compiler(source, i);
    }
    return std::nullopt;
  }

  bool instrument() {
    std::vector<std::string> codes;
    for (const std::string& file : files_) {
      auto code = context_.folder().read(file);
      if (!context_.has(code)) return false;
      codes.push_back(*std::move(code));
    }
    const auto header = context_.folder().read("generated.hpp");
    if (!context_.has(header)) return false;
    auto made =
        strucpp::with_statements(codes, context_.project, strucpp::CppValues(*header, context_.sources));
    for (std::size_t i = 0; i < files_.size(); ++i) {
      if (!context_.has(context_.folder().replace(files_[i], made.texts[i]))) return false;
    }
    pous_ = std::move(made.pous);
    return context_.has(context_.folder().write(std::string(iec::kDebugFile), iec::debug_header(pous_)));
  }

  // The compiler keeps temporary variables from call to call.
  bool renew_temporaries() {
    return context_.rewrite(files_, [this](const std::string& code) {
      return strucpp::with_new_temporaries(code, context_.project);
    });
  }

  bool write_order() {
    nlohmann::json list = nlohmann::json::array();
    const std::set<std::string> enumerations = strucpp::enumerations_in(context_.sources);
    const strucpp::Constants constants = strucpp::constants_in(context_.sources);
    for (std::size_t i = 0; i < context_.sources.size(); ++i) {
      const iec::Source& source = context_.sources[i];
      const strucpp::SourceText made = strucpp::text_for_strucpp(source, enumerations, constants);
      nlohmann::json places = nlohmann::json::array();
      for (const auto& [line, name, location] : made.places)
        places.push_back({{"line", line}, {"name", name}, {"location", location}});
      nlohmann::json inserted = nlohmann::json::array();
      for (const auto& [line, column, characters] : made.inserted)
        inserted.push_back({{"line", line}, {"column", column}, {"length", characters}});
      list.push_back({{"name", name_for_compiler(source.file, i)},
                      {"text", made.text},
                      {"places", std::move(places)},
                      {"inserted", std::move(inserted)}});
    }
    // A byte that is no UTF-8 becomes a sign that the compiler refuses, unless it stands in a comment.
    const std::string text = nlohmann::json{{"sources", std::move(list)}}.dump(
        -1, ' ', false, nlohmann::json::error_handler_t::replace);
    return context_.has(context_.folder().write("order.json", text));
  }

  bool run() {
    const auto end = context_.run("node (Node.js, which STruC++ needs)",
                                  {"node", context_.adapters() + "/strucpp/translate.mjs", compiler_.folder},
                                  context_.order.translate_limit);
    if (!end) return false;
    if (end->signal != 0) {
      context_.fail(fmt::format("STruC++ was ended by SIG{}", ::sigabbrev_np(end->signal)));
    } else if (end->exit_code != 0) {
      context_.fail("STruC++ has failed:" + first_lines(end->output));
    }
    return context_.good() && context_.has(context_.folder().check_room());
  }

  // Of some things of the language it says only that another word was expected.
  void explain(const iec::Project& project) {
    for (const iec::Configuration& configuration : project.configurations) {
      for (const iec::Resource& resource : configuration.resources) {
        if (configuration.resources.size() > 1) refuse_globals(resource);
        for (const iec::Program& program : resource.programs) {
          if (!program.connected) continue;
          context_.fail({program.place, fmt::format("PROGRAM {}: STruC++ cannot translate connections in "
                                                    "parentheses; use VAR_EXTERNAL in {}",
                                                    program.name, program.type)});
        }
      }
    }
  }

  // Those of a single resource were moved to the configuration.
  void refuse_globals(const iec::Resource& resource) {
    for (const iec::Variable& global : resource.globals) {
      context_.fail({global.place, fmt::format("{}: STruC++ knows no VAR_GLOBAL in a RESOURCE; declare it "
                                               "in the CONFIGURATION",
                                               global.name)});
    }
  }

  BuildContext& context_;
  strucpp::Compiler compiler_;
  std::vector<std::string> files_;
  std::vector<strucpp::PlannedSymbol> symbols_;
  std::vector<iec::DebugPou> pous_;  // of a debug build
  std::vector<std::string> words_;
  std::vector<std::string> flags_;
};

}  // namespace

std::unique_ptr<Translator> make_strucpp_translator(BuildContext& context) {
  return std::make_unique<StrucppTranslator>(context);
}

}  // namespace plchost
