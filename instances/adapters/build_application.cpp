#include "instances/adapters/build_application.hpp"

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <iterator>
#include <optional>
#include <ranges>
#include <sstream>
#include <utility>

#include <fmt/format.h>
#include <sys/stat.h>

#include "instances/adapters/c_compiler.hpp"
#include "instances/adapters/iec/project.hpp"
#include "instances/adapters/iec/task_file.hpp"
#include "instances/adapters/iec/tokens.hpp"
#include "instances/adapters/matiec/glue.hpp"
#include "instances/adapters/matiec/iec2c.hpp"
#include "instances/adapters/matiec/located.hpp"
#include "instances/adapters/matiec/task_plan.hpp"
#include "instances/adapters/output_file.hpp"
#include "instances/adapters/run_program.hpp"
#include "instances/adapters/text_files.hpp"
#include "instances/adapters/work_folder.hpp"

namespace plchost {

namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxSource = std::size_t{16} << 20;
constexpr std::size_t kMaxTaskFile = std::size_t{1} << 20;
constexpr const char* kConfigurationFile = "plchost_configuration.c";
constexpr std::ptrdiff_t kShownLines = 20;  // of a C compiler's output

std::string first_lines(const std::string& text) {
  std::istringstream stream(text);
  std::string result;
  std::string line;
  for (std::ptrdiff_t i = 0; i < kShownLines && std::getline(stream, line); ++i) result += "\n  " + line;
  return result;
}

/// Whether a file lies in that folder, wherever links lead.
bool lies_in(const fs::path& file, const fs::path& folder) {
  std::error_code error;
  const fs::path inside = fs::weakly_canonical(fs::absolute(folder, error), error);
  const fs::path there = fs::weakly_canonical(fs::absolute(file, error), error);
  return !error && std::ranges::mismatch(inside, there).in1 == inside.end();
}

class Build {
 public:
  explicit Build(const BuildOrder& order) : order_(order) {}

  BuildReport run() {
    if (read_sources() && can_be_planned() && outputs_are_free() && translate()) {
      for (const iec::Resource& resource : configuration().resources) make(resource);
      if (report_.problems.empty()) publish();
    }
    return std::move(report_);
  }

 private:
  void fail(iec::SourceProblem problem) { report_.problems.push_back(std::move(problem)); }
  void fail(std::string text) { fail({{}, std::move(text)}); }
  // Whether it has succeeded: an error is among the problems.
  template <class T>
  bool has(const Result<T>& result) {
    if (!result) fail(result.error().describe());
    return result.has_value();
  }
  [[nodiscard]] const iec::Configuration& configuration() const { return project_.configurations.front(); }

  bool read_sources() {
    std::error_code error;
    for (const std::string& name : order_.sources) {
      if (!fs::is_directory(name, error)) {
        read_source(name);
        continue;
      }
      std::vector<std::string> files;
      for (fs::directory_iterator it(name, error), end; !error && it != end; it.increment(error)) {
        if (iec::folded(it->path().extension().string()) == ".ST") files.push_back(it->path());
      }
      if (error) {
        fail({{name, 0, 0}, fmt::format("this folder cannot be read: {}", error.message())});
        continue;
      }
      if (files.empty()) fail({{name, 0, 0}, "this folder has no file *.st"});
      std::ranges::sort(files);
      for (const std::string& file : files) read_source(file);
    }
    if (!report_.problems.empty()) return false;
    auto [project, problems] = iec::read_project(sources_);
    project_ = std::move(project);
    std::ranges::move(problems, std::back_inserter(report_.problems));
    if (report_.problems.empty() && project_.configurations.size() != 1) {
      fail(fmt::format(
          "the sources have {} CONFIGURATIONs; an application has one, which says what its tasks are",
          project_.configurations.size()));
    }
    if (report_.problems.empty()) check_file_names();
    if (report_.problems.empty()) read_task_file();
    return report_.problems.empty();
  }
  // iec2c makes a file of each of these names. The files of the library are found by name, too.
  void check_file_names() {
    std::vector<std::string> names{"POUS", "LOCATED_VARIABLES", "IEC_STD_LIB", "ACCESSOR"};
    const auto check = [&](const char* kind, const std::string& given, const iec::SourcePlace& place) {
      const std::string name = iec::folded(given);
      if (std::ranges::find(names, name) != names.end() || name.starts_with("PLCHOST_")) {
        fail({place, fmt::format("{} {}: a file of the build or another RESOURCE has this name; choose "
                                 "another one",
                                 kind, given)});
      }
      names.push_back(name);
    };
    check("CONFIGURATION", configuration().name, configuration().place);
    for (const iec::Resource& resource : configuration().resources)
      check("RESOURCE", resource.name, resource.place);
    if (configuration().resources.empty())
      fail({configuration().place, "this CONFIGURATION runs no program"});
  }
  void read_task_file() {
    std::string file = order_.tasks;
    if (file.empty() && sources_.size() == 1) {
      std::error_code error;
      const fs::path beside = fs::path(sources_.front().file).replace_extension(".toml");
      if (!fs::is_regular_file(beside, error)) return;
      file = beside;
      report_.remarks.push_back(
          {{file, 0, 0},
           fmt::format("is read as the task file of {}, as it lies beside it", sources_.front().file)});
    }
    if (file.empty()) return;
    auto read = read_text_file(file, kMaxTaskFile);
    if (!has(read)) return;
    identities_.push_back(read->identity);
    std::ranges::move(iec::read_task_file({file, std::move(read->text)}, project_.configurations.front()),
                      std::back_inserter(report_.problems));
  }
  void read_source(const std::string& file) {
    auto read = read_text_file(file, kMaxSource);
    if (!has(read)) return;
    sources_.push_back({file, std::move(read->text)});
    identities_.push_back(read->identity);
  }

  // Before iec2c sees them: of some it says nothing, by others it is ended.
  bool can_be_planned() {
    for (const iec::Resource& resource : configuration().resources) {
      const auto plan = matiec::plan_tasks(project_, configuration(), resource);
      std::ranges::copy(plan.problems, std::back_inserter(report_.problems));
    }
    return report_.problems.empty();
  }

  bool outputs_are_free() {
    for (const iec::Resource& resource : configuration().resources) {
      const std::string output = output_of(resource);
      if (std::string why = why_no_output(output); !why.empty()) fail(std::move(why));
      struct stat status{};
      if (::stat(output.c_str(), &status) == 0 &&
          std::ranges::find(identities_, FileIdentity{status.st_dev, status.st_ino}) != identities_.end()) {
        fail(fmt::format("{} is one of the files that are read; name another one by -o", output));
      }
      if (!order_.keep.empty() && lies_in(output, order_.keep))
        fail(fmt::format("{} lies in the folder of --keep, which a build empties; name another one", output));
    }
    for (const iec::Source& source : sources_) {
      if (!order_.keep.empty() && lies_in(source.file, order_.keep))
        fail({{source.file, 0, 0}, "lies in the folder of --keep, which a build empties; name another one"});
    }
    return report_.problems.empty();
  }

  bool translate() {
    auto compiler = matiec::find_compiler(order_.matiec);
    auto words = c_compiler_words(std::getenv("CC"));  // NOLINT(concurrency-mt-unsafe): one thread here
    if (!has(compiler) || !has(words)) return false;
    compiler_ = *std::move(compiler);
    c_compiler_ = *std::move(words);
    auto folder = order_.keep.empty() ? WorkFolder::make_temporary() : WorkFolder::make_kept(order_.keep);
    if (!has(folder)) return false;
    work_.emplace(*std::move(folder));
    const matiec::JoinedSource joined(sources_);
    if (!has(work_->write(std::string(matiec::kJoinedFile), joined.text()))) return false;
    const auto end = run("iec2c",
                         {fs::absolute(compiler_.program), "-f", "-p", "-l", "-I",
                          fs::absolute(compiler_.library), "-T", ".", std::string(matiec::kJoinedFile)},
                         order_.translate_limit);
    if (!end) return false;
    std::ranges::move(matiec::problems_of(end->output, joined, project_, compiler_.library),
                      std::back_inserter(report_.problems));
    if (report_.problems.empty() && end->signal != 0) {
      fail(fmt::format("iec2c was ended by SIG{}, and has not said which line it could not translate",
                       ::sigabbrev_np(end->signal)));
    } else if (report_.problems.empty() && end->exit_code != 0) {
      fail("iec2c has failed:" + first_lines(end->output));
    }
    if (!report_.problems.empty() || !has(work_->check_room())) return false;
    auto located = work_->read("LOCATED_VARIABLES.h");
    if (!located) {
      fail("iec2c has not done its work: " + located.error().describe());
      return false;
    }
    located_ = matiec::located_variables(*located);
    return has(work_->write(
        kConfigurationFile,
        fmt::format("#include \"plchost_library.h\"\n#include \"{}.c\"\n", configuration().name)));
  }

  void make(const iec::Resource& resource) {
    matiec::Glue glue = matiec::write_glue(project_, configuration(), resource, located_);
    std::ranges::move(glue.problems, std::back_inserter(report_.problems));
    std::ranges::move(glue.remarks, std::back_inserter(report_.remarks));
    if (!report_.problems.empty()) return;
    const std::string name = "plchost_" + (resource.name.empty() ? "RESOURCE" : resource.name);
    if (!has(work_->write(name + ".c", "#include \"plchost_library.h\"\n" + glue.text))) return;
    const fs::path made = work_->path() / (name + ".so");
    if (!compile(name + ".c", made) || !check(made)) return;
    auto output = OutputFile::make(made, output_of(resource));
    if (has(output)) outputs_.push_back(*std::move(output));
  }

  bool compile(const std::string& glue, const fs::path& made) {
    const std::string adapters = fs::absolute(order_.adapters);
    std::vector<std::string> command = c_compiler_;
    std::ranges::move(
        c_compiler_arguments({.sources = {glue, kConfigurationFile, adapters + "/matiec/application.c",
                                          adapters + "/matiec/places.c", adapters + "/matiec/variables.c"},
                              .folders = {adapters, adapters + "/matiec", fs::absolute(compiler_.headers)},
                              .output = made}),
        std::back_inserter(command));
    const auto end = run("the C compiler", command, order_.compile_limit);
    if (end && !end->success())
      fail("the C compiler refuses what iec2c has written:" + first_lines(end->output));
    return end && end->success();
  }

  bool check(const fs::path& made) {
    if (order_.check_program.empty()) return true;
    const auto end = run("the check by plc-instance", {order_.check_program, "--check-application", made},
                         order_.translate_limit);
    if (end && !end->success()) fail("plc-instance refuses the application:" + first_lines(end->output));
    return end && end->success();
  }

  /// None: it has not run to its end, and why is among the problems.
  std::optional<ProgramEnd> run(const char* what, const std::vector<std::string>& command, Duration limit) {
    auto end = run_program(command, work_->path(), {.time = limit, .cancelled = order_.cancelled});
    if (!end) {
      fail(fmt::format("{} cannot be started: {}", what, end.error().describe()));
    } else if (end->cancelled) {
      fail("interrupted: nothing was built");
    } else if (end->over_limit) {
      fail(fmt::format("{} has run for {} s and was ended; make the program smaller, or use a faster machine",
                       what, std::chrono::duration_cast<std::chrono::seconds>(limit).count()));
    } else {
      return *std::move(end);
    }
    return std::nullopt;
  }

  [[nodiscard]] fs::path output_of(const iec::Resource& resource) const {
    fs::path output = order_.output;
    if (configuration().resources.size() == 1) return output;
    return output.replace_filename(output.stem().string() + "-" + resource.name +
                                   output.extension().string());
  }
  // All, or none.
  void publish() {
    for (OutputFile& output : outputs_) {
      if (!has(output.publish())) return;
    }
    for (OutputFile& output : outputs_) {
      report_.applications.push_back(output.path());
      output.keep();
    }
  }

  const BuildOrder& order_;
  std::optional<WorkFolder> work_;
  std::vector<iec::Source> sources_;
  std::vector<FileIdentity> identities_;  // of all files that are read
  iec::Project project_;
  matiec::Compiler compiler_;
  std::vector<std::string> c_compiler_;
  std::vector<matiec::Located> located_;
  std::vector<OutputFile> outputs_;
  BuildReport report_;
};

}  // namespace

BuildReport build_application(const BuildOrder& order) {
  return Build(order).run();
}

}  // namespace plchost
