#include "instances/adapters/build_application.hpp"

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <ranges>
#include <sstream>
#include <utility>

#include <fmt/format.h>

#include "instances/adapters/iec/project.hpp"
#include "instances/adapters/iec/task_file.hpp"
#include "instances/adapters/iec/tokens.hpp"
#include "instances/adapters/matiec/glue.hpp"
#include "instances/adapters/matiec/iec2c.hpp"
#include "instances/adapters/matiec/located.hpp"
#include "instances/adapters/matiec/task_plan.hpp"
#include "instances/adapters/run_program.hpp"

namespace plchost {

namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxSource = std::size_t{16} << 20;
constexpr std::size_t kMaxTaskFile = std::size_t{1} << 20;
constexpr std::ptrdiff_t kShownLines = 20;  // of a C compiler's output

std::string text_of(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

std::string first_lines(const std::string& text) {
  std::istringstream stream(text);
  std::string result;
  std::string line;
  for (std::ptrdiff_t i = 0; i < kShownLines && std::getline(stream, line); ++i) result += "\n  " + line;
  return result;
}

/// A folder that goes with its owner, unless it is to be kept.
class WorkFolder {
 public:
  explicit WorkFolder(std::string kept) : path_(std::move(kept)), kept_(!path_.empty()) {
    std::error_code error;
    if (kept_) {
      fs::create_directories(path_, error);
    } else {
      std::string pattern = (fs::temp_directory_path(error) / "plchost-build.XXXXXX").string();
      if (::mkdtemp(pattern.data()) != nullptr) path_ = pattern;
    }
    std::error_code ignored;
    if (!path_.empty()) path_ = fs::absolute(path_, ignored);
  }
  WorkFolder(const WorkFolder&) = delete;
  WorkFolder& operator=(const WorkFolder&) = delete;
  ~WorkFolder() {
    std::error_code error;
    if (!kept_ && !path_.empty()) fs::remove_all(path_, error);
  }
  [[nodiscard]] const fs::path& path() const noexcept { return path_; }
  [[nodiscard]] bool is_there() const {
    std::error_code error;
    return fs::is_directory(path_, error);
  }

 private:
  fs::path path_;
  bool kept_;
};

class Build {
 public:
  explicit Build(const BuildOrder& order) : order_(order), work_(order.keep) {}

  BuildReport run() {
    if (read_sources() && can_be_planned() && translate()) {
      for (const iec::Resource& resource : configuration().resources) make(resource);
    }
    if (!report_.problems.empty()) remove_made();
    return std::move(report_);
  }

 private:
  void fail(iec::SourceProblem problem) { report_.problems.push_back(std::move(problem)); }
  void fail(std::string text) { fail({{}, std::move(text)}); }
  [[nodiscard]] const iec::Configuration& configuration() const { return project_.configurations.front(); }

  bool read_sources() {
    std::error_code error;
    for (const std::string& name : order_.sources) {
      if (!fs::is_directory(name, error)) {
        read_source(name);
        continue;
      }
      std::vector<std::string> files;
      for (const auto& entry : fs::directory_iterator(name, error)) {
        if (iec::folded(entry.path().extension().string()) == ".ST") files.push_back(entry.path());
      }
      if (files.empty()) fail({{name, 0, 0}, "this folder has no file *.st"});
      std::ranges::sort(files);
      for (const std::string& file : files) read_source(file);
    }
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
  // iec2c makes a file for each of these names, and for the POUs.
  void check_file_names() {
    std::vector<std::string> names{"POUS", iec::folded(configuration().name)};
    for (const iec::Resource& resource : configuration().resources) {
      const std::string name = iec::folded(resource.name);
      if (std::ranges::find(names, name) != names.end()) {
        fail({resource.place,
              fmt::format("RESOURCE {}: this name is taken by the CONFIGURATION, by another RESOURCE or by "
                          "a file of iec2c (POUS)",
                          resource.name)});
      }
      names.push_back(name);
    }
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
    std::error_code error;
    const auto size = fs::file_size(file, error);
    if (error) return fail({{file, 0, 0}, fmt::format("cannot be read: {}", error.message())});
    if (size > kMaxTaskFile) return fail({{file, 0, 0}, "is larger than 1 MiB"});
    std::ranges::move(iec::read_task_file({file, text_of(file)}, project_.configurations.front()),
                      std::back_inserter(report_.problems));
  }
  void read_source(const std::string& file) {
    std::error_code error;
    const auto size = fs::file_size(file, error);
    if (error) return fail({{file, 0, 0}, fmt::format("cannot be read: {}", error.message())});
    if (size > kMaxSource) return fail({{file, 0, 0}, "is larger than 16 MiB"});
    sources_.push_back({file, text_of(file)});
  }

  // Before iec2c sees them: of some it says nothing, by others it is ended.
  bool can_be_planned() {
    for (const iec::Resource& resource : configuration().resources) {
      const auto plan = matiec::plan_tasks(project_, configuration(), resource);
      std::ranges::copy(plan.problems, std::back_inserter(report_.problems));
    }
    return report_.problems.empty();
  }

  bool translate() {
    const auto compiler = matiec::find_compiler(order_.matiec);
    if (!compiler) {
      fail(compiler.error().describe());
      return false;
    }
    compiler_ = *compiler;
    if (!work_.is_there()) {
      fail(fmt::format("the folder {} for the files between cannot be made", work_.path().string()));
      return false;
    }
    const matiec::JoinedSource joined(sources_);
    std::ofstream(work_.path() / matiec::kJoinedFile) << joined.text();
    const auto end =
        run_program({fs::absolute(compiler_.program), "-f", "-p", "-l", "-I", fs::absolute(compiler_.library),
                     "-T", ".", std::string(matiec::kJoinedFile)},
                    work_.path());
    if (!end) {
      fail(end.error().describe());
      return false;
    }
    std::ranges::move(matiec::problems_of(end->output, joined, project_, compiler_.library),
                      std::back_inserter(report_.problems));
    if (report_.problems.empty() && end->signal != 0) {
      fail(fmt::format("iec2c was ended by {}, and has not said which line it could not translate",
                       ::sigabbrev_np(end->signal)));
    } else if (report_.problems.empty() && end->exit_code != 0) {
      fail("iec2c has failed:" + first_lines(end->output));
    }
    return report_.problems.empty();
  }

  void make(const iec::Resource& resource) {
    matiec::Glue glue =
        matiec::write_glue(project_, configuration(), resource,
                           matiec::located_variables(text_of(work_.path() / "LOCATED_VARIABLES.h")));
    std::ranges::move(glue.problems, std::back_inserter(report_.problems));
    std::ranges::move(glue.remarks, std::back_inserter(report_.remarks));
    if (!report_.problems.empty()) return;
    const std::string name = "application_" + (resource.name.empty() ? "RESOURCE" : resource.name);
    std::ofstream(work_.path() / (name + ".c")) << glue.text;
    const fs::path made = work_.path() / (name + ".so");
    compile(name + ".c", made);
    if (report_.problems.empty()) check(made);
    if (report_.problems.empty()) put(made, output_of(resource));
  }

  // All symbols of the program are its own, so that two versions can be loaded at a time.
  void compile(const std::string& glue, const fs::path& made) {
    const char* const chosen =
        std::getenv("CC");  // NOLINT(concurrency-mt-unsafe): plcctl has one thread here
    const std::string adapters = fs::absolute(order_.adapters);
    const auto end = run_program({chosen == nullptr ? "cc" : chosen,
                                  "-std=gnu11",
                                  "-O2",
                                  "-g1",
                                  "-w",
                                  "-fPIC",
                                  "-shared",
                                  "-fvisibility=hidden",
                                  "-D__CURRENT_TIME=(*plchost_now())",
                                  "-I.",
                                  "-I" + adapters,
                                  "-I" + adapters + "/matiec",
                                  "-I" + fs::absolute(compiler_.headers).string(),
                                  "-o",
                                  made,
                                  glue,
                                  configuration().name + ".c",
                                  adapters + "/matiec/application.c",
                                  adapters + "/matiec/places.c",
                                  adapters + "/matiec/variables.c",
                                  "-lm"},
                                 work_.path());
    if (!end) return fail(end.error().describe());
    if (!end->success()) fail("the C compiler refuses what iec2c has written:" + first_lines(end->output));
  }

  void check(const fs::path& made) {
    if (order_.check_program.empty()) return;
    const auto end = run_program({order_.check_program, "--check-application", made}, work_.path());
    if (!end) return fail(end.error().describe());
    if (!end->success()) fail("plc-instance refuses the application:" + first_lines(end->output));
  }

  [[nodiscard]] fs::path output_of(const iec::Resource& resource) const {
    fs::path output = order_.output;
    if (configuration().resources.size() == 1) return output;
    return output.replace_filename(output.stem().string() + "-" + resource.name +
                                   output.extension().string());
  }
  // A reader of the old file sees it whole.
  void put(const fs::path& made, const fs::path& output) {
    std::error_code error;
    const fs::path beside = output.string() + ".new";
    fs::copy_file(made, beside, fs::copy_options::overwrite_existing, error);
    if (!error) fs::rename(beside, output, error);
    if (error) return fail(fmt::format("{} cannot be written: {}", output.string(), error.message()));
    report_.applications.push_back(output);
  }
  void remove_made() {
    std::error_code error;
    for (const std::string& application : report_.applications) fs::remove(application, error);
    report_.applications.clear();
  }

  const BuildOrder& order_;
  WorkFolder work_;
  std::vector<iec::Source> sources_;
  iec::Project project_;
  matiec::Compiler compiler_;
  BuildReport report_;
};

}  // namespace

BuildReport build_application(const BuildOrder& order) {
  return Build(order).run();
}

}  // namespace plchost
