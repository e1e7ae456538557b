#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "instances/adapters/build_application.hpp"
#include "instances/adapters/c_compiler.hpp"
#include "instances/adapters/compiler_output.hpp"
#include "instances/adapters/iec/project.hpp"
#include "instances/adapters/plcopen/structured_text.hpp"
#include "instances/adapters/run_program.hpp"
#include "instances/adapters/work_folder.hpp"

namespace plchost {

/// State that the parts of one build share. A function that returns false, or nothing, has added why to
/// `report`.
class BuildContext {
 public:
  explicit BuildContext(const BuildOrder& given) : order(given) {}

  const BuildOrder& order;
  BuildReport report;
  std::vector<iec::Source> sources;
  plcopen::ProjectSources projects;  ///< those of the sources that are PLCopen XML
  iec::Project project;

  void fail(iec::SourceProblem problem) { report.problems.push_back(std::move(problem)); }
  void fail(std::string text) { fail({{}, std::move(text)}); }
  [[nodiscard]] bool good() const noexcept { return report.problems.empty(); }
  /// Whether it has succeeded.
  template <class T>
  bool has(const Result<T>& result) {
    if (!result) fail(result.error().describe());
    return result.has_value();
  }

  /// Each PERSISTENT is a problem.
  void refuse_persistent(const iec::Project& read, const char* compiler);
  /// Makes the folder for the files between. Once.
  bool open_folder();
  [[nodiscard]] const WorkFolder& folder() const { return *folder_; }
  /// Each file of that folder becomes what `change` makes of it.
  bool rewrite(std::span<const std::string> files,
               const std::function<std::string(const std::string&)>& change);
  /// Runs a program in that folder. Nothing: it has not run to its end.
  std::optional<ProgramEnd> run(const char* what, const std::vector<std::string>& command, Duration limit);
  /// Runs a compiler for C or C++. `words`: its command. Errors in a source are told there.
  bool compile(const char* what, std::vector<std::string> words, const CompileOrder& compile_order,
               const FindSource& find_source);
  /// The words of the command in this variable of the environment; else `usual`.
  std::optional<std::vector<std::string>> words_of(const char* variable, const char* usual);
  [[nodiscard]] std::string adapters() const { return std::filesystem::absolute(order.adapters); }
  /// The C files of each application.
  [[nodiscard]] std::vector<std::string> application_files() const;

 private:
  std::optional<WorkFolder> folder_;
};

/// Of a compiler's output, one below the other.
[[nodiscard]] std::string first_lines(const std::string& text);

}  // namespace plchost
