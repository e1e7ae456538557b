#include "instances/adapters/build_application.hpp"

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <memory>
#include <ranges>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/stat.h>

#include "instances/adapters/build_context.hpp"
#include "instances/adapters/iec/project.hpp"
#include "instances/adapters/iec/task_file.hpp"
#include "instances/adapters/iec/task_plan.hpp"
#include "instances/adapters/iec/tokens.hpp"
#include "instances/adapters/output_file.hpp"
#include "instances/adapters/plcopen/structured_text.hpp"
#include "instances/adapters/text_files.hpp"
#include "instances/adapters/translator.hpp"
#include "instances/adapters/work_folder.hpp"

namespace plchost {

namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxSource = std::size_t{16} << 20;
constexpr std::size_t kMaxTaskFile = std::size_t{1} << 20;

/// Whether a file lies in that folder, wherever links lead.
bool lies_in(const fs::path& file, const fs::path& folder) {
  std::error_code error;
  const fs::path inside = fs::weakly_canonical(fs::absolute(folder, error), error);
  const fs::path there = fs::weakly_canonical(fs::absolute(file, error), error);
  return !error && std::ranges::mismatch(inside, there).in1 == inside.end();
}

/// The lines to write for the first program; empty: there is none.
std::string proposed_configuration(const iec::Project& project) {
  const auto program = std::ranges::find(project.pous, iec::Pou::Kind::program, &iec::Pou::kind);
  if (program == project.pous.end()) return "";
  return fmt::format(
      ". Write these lines in a source of the build:\n"
      "  CONFIGURATION config0 RESOURCE resource0 ON PLC\n"
      "    TASK task0 (INTERVAL := T#20ms, PRIORITY := 1);\n"
      "    PROGRAM instance0 WITH task0 : {};\n"
      "  END_RESOURCE END_CONFIGURATION",
      program->name);
}

class Build {
 public:
  explicit Build(const BuildOrder& order) : order_(order), context_(order) {}

  BuildReport run() {
    if (read_files() && keeps_apart() && choose() && translator_->read() && is_one_configuration() &&
        can_be_planned() && outputs_are_free() && translator_->translate()) {
      for (const iec::Resource& resource : configuration().resources) make(resource);
      if (context_.good()) publish();
    }
    context_.projects.restore(context_.report.problems, context_.report.remarks);
    return std::move(context_.report);
  }

 private:
  [[nodiscard]] const iec::Configuration& configuration() const {
    return context_.project.configurations.front();
  }

  bool read_files() {
    std::error_code error;
    for (const std::string& name : order_.sources) {
      if (!fs::is_directory(name, error)) {
        read_source(name);
        continue;
      }
      std::vector<std::string> files = files_in(name, error);
      if (error) {
        context_.fail({{name, 0, 0}, fmt::format("this folder cannot be read: {}", error.message())});
        continue;
      }
      if (files.empty()) context_.fail({{name, 0, 0}, "this folder has no file *.st"});
      std::ranges::sort(files);
      for (const std::string& file : files) read_source(file);
    }
    return context_.good();
  }
  // *.st, also in its folders; but for hidden ones, what an earlier build has left, and folders of others.
  [[nodiscard]] static std::vector<std::string> files_in(const std::string& folder, std::error_code& error) {
    std::vector<std::string> files;
    constexpr auto kOptions = fs::directory_options::skip_permission_denied;
    (void)fs::directory_iterator(folder, error);  // of the folder itself it is an error
    if (error) return files;
    for (fs::recursive_directory_iterator it(folder, kOptions, error), end; !error && it != end;
         it.increment(error)) {
      std::error_code none;  // a link that leads nowhere is no folder
      const bool is_hidden = it->path().filename().string().starts_with('.');
      if (it->is_directory(none)) {
        if (is_hidden || WorkFolder::is_kept(it->path())) it.disable_recursion_pending();
      } else if (!is_hidden && iec::folded(it->path().extension().string()) == ".ST") {
        files.push_back(it->path());
      }
    }
    return files;
  }
  void read_source(const std::string& file) {
    auto read = read_text_file(file, kMaxSource);
    if (!context_.has(read)) return;
    iec::Source source{file, std::move(read->text)};
    if (plcopen::is_project_file(file)) source = context_.projects.take(source, context_.report.problems);
    context_.sources.push_back(std::move(source));
    identities_.push_back(read->identity);
  }

  // A build empties the folder of --keep.
  bool keeps_apart() {
    if (order_.keep.empty()) return true;
    if (lies_in(order_.output, order_.keep)) {
      context_.fail(fmt::format("{} lies in the folder of --keep, which a build empties; name another one",
                                order_.output));
    }
    for (const iec::Source& source : context_.sources) {
      if (lies_in(source.file, order_.keep)) {
        context_.fail(
            {{source.file, 0, 0}, "lies in the folder of --keep, which a build empties; name another one"});
      }
    }
    return context_.good();
  }

  bool choose() {
    translator_ = choose_translator(context_);
    if (translator_ != nullptr) context_.projects.fit_lengths(context_.sources, translator_->compiler());
    return translator_ != nullptr;
  }

  bool is_one_configuration() {
    const auto& all = context_.project.configurations;
    if (all.empty()) {
      context_.fail(
          {{context_.sources.front().file, 0, 0},
           fmt::format("there is no CONFIGURATION in {}; an application has one, which says what its "
                       "tasks are{}",
                       names_of_sources(), proposed_configuration(context_.project))});
    } else if (all.size() != 1) {
      context_.fail(
          {all[1].place, fmt::format("the sources have {} CONFIGURATIONs, of which the first one is {}; "
                                     "an application has one",
                                     all.size(), all[0].name)});
    } else if (configuration().resources.empty()) {
      context_.fail({configuration().place, "this CONFIGURATION runs no program"});
    }
    if (context_.good()) read_task_file();
    if (context_.good()) context_.projects.add_events(context_.project.configurations.front());
    return context_.good();
  }
  [[nodiscard]] std::string names_of_sources() const {
    if (context_.sources.size() == 1) return "this file";
    constexpr std::ptrdiff_t kShown = 10;
    const auto names =
        context_.sources | std::views::take(kShown) | std::views::transform(&iec::Source::file);
    return fmt::format("{}{}", fmt::join(names, ", "), std::ssize(context_.sources) > kShown ? ", ..." : "");
  }
  // Of a single source line.st: line.toml. Of a single folder line: line.toml beside it, or tasks.toml in it.
  [[nodiscard]] std::vector<fs::path> task_files() const {
    std::vector<fs::path> found;
    if (order_.sources.size() != 1) return found;
    std::error_code error;
    const auto add = [&](const fs::path& file) {
      if (fs::is_regular_file(file, error) && std::ranges::find(found, file) == found.end())
        found.push_back(file);
    };
    const fs::path source = order_.sources.front();
    if (fs::is_directory(source, error)) {
      add(source / "tasks.toml");
      const fs::path folder = fs::absolute(source, error).lexically_normal();
      add((folder.has_filename() ? folder : folder.parent_path()).string() + ".toml");
    }
    if (context_.sources.size() == 1) add(fs::path(context_.sources.front().file).replace_extension(".toml"));
    return found;
  }
  void read_task_file() {
    std::string file = order_.tasks;
    if (file.empty()) {
      const std::vector<fs::path> found = task_files();
      if (found.size() > 1) {
        return context_.fail(
            {{found[0].string(), 0, 0},
             fmt::format("and {} may both be the task file: choose by --tasks", found[1].string())});
      }
      if (found.empty()) return;
      file = found.front();
      context_.report.remarks.push_back(
          {{file, 0, 0}, fmt::format("is read as the task file of {}", order_.sources.front())});
    }
    auto read = read_text_file(file, kMaxTaskFile);
    if (!context_.has(read)) return;
    identities_.push_back(read->identity);
    std::ranges::move(
        iec::read_task_file({file, std::move(read->text)}, context_.project.configurations.front()),
        std::back_inserter(context_.report.problems));
  }

  // Before the compilers see it: of some things they say nothing, by others they are ended.
  bool can_be_planned() {
    for (const iec::Resource& resource : configuration().resources) {
      const auto plan = iec::plan_tasks(context_.project, configuration(), resource, translator_->compiler());
      std::ranges::copy(plan.problems, std::back_inserter(context_.report.problems));
    }
    return context_.good();
  }

  bool outputs_are_free() {
    for (const iec::Resource& resource : configuration().resources) {
      const std::string output = output_of(resource);
      if (std::string why = why_no_output(output); !why.empty()) context_.fail(std::move(why));
      struct stat status{};
      if (::stat(output.c_str(), &status) == 0 &&
          std::ranges::find(identities_, FileIdentity{status.st_dev, status.st_ino}) != identities_.end()) {
        context_.fail(fmt::format("{} is one of the files that are read; name another one by -o", output));
      }
    }
    return context_.good();
  }

  void make(const iec::Resource& resource) {
    iec::Glue glue = translator_->glue(resource);
    std::ranges::move(glue.problems, std::back_inserter(context_.report.problems));
    std::ranges::move(glue.remarks, std::back_inserter(context_.report.remarks));
    if (!context_.good()) return;
    const std::string name = "plchost_" + (resource.name.empty() ? "RESOURCE" : resource.name);
    const fs::path made = context_.folder().path() / (name + ".so");
    if (!translator_->compile(name, glue.text, made) || !check(made)) return;
    auto output = OutputFile::make(made, output_of(resource));
    if (context_.has(output)) outputs_.push_back(*std::move(output));
  }

  bool check(const fs::path& made) {
    if (order_.check_program.empty()) return true;
    const auto end =
        context_.run("the check by plc-instance", {order_.check_program, "--check-application", made},
                     order_.translate_limit);
    if (!end || end->success()) return end.has_value();
    for (iec::SourceProblem& problem : pragmas_with(undefined_symbol(end->output), context_.sources))
      context_.fail(std::move(problem));
    if (context_.good()) context_.fail("plc-instance refuses the application:" + first_lines(end->output));
    return false;
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
      if (!context_.has(output.publish())) return;
    }
    for (OutputFile& output : outputs_) {
      context_.report.applications.push_back(output.path());
      output.keep();
    }
  }

  const BuildOrder& order_;
  BuildContext context_;
  std::unique_ptr<Translator> translator_;
  std::vector<FileIdentity> identities_;  // of all files that are read
  std::vector<OutputFile> outputs_;
};

}  // namespace

BuildReport build_application(const BuildOrder& order) {
  return Build(order).run();
}

}  // namespace plchost
