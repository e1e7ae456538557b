// plchost-bench: what plchost costs, beside the floor that the machine sets in the same minute.

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <optional>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <unistd.h>

#include "tests/bench/child.hpp"
#include "tests/bench/parts.hpp"
#include "tests/bench/plot.hpp"

namespace {

using namespace plchost;  // NOLINT(google-build-using-namespace): a program's main file

struct Options {
  std::string json;
  std::string markdown;
  std::string plots;
  bool quick = false;
  bool stress = false;
  int seconds = 0;
  std::vector<std::string> only;
};

bench::Plan make_plan(const Options& options) {
  bench::Plan plan;
  if (options.quick) {
    plan.each = std::chrono::seconds(5);
    plan.slice = std::chrono::milliseconds(2500);
    plan.starts = 20;
  }
  if (options.seconds > 0) plan.each = std::chrono::seconds(options.seconds);
  const auto cores = online_cores();
  // Two different cores where there are two; else everything shares the one.
  plan.task_core = cores && !cores->empty() ? cores->back() : 0;
  plan.poster_core = cores && !cores->empty() ? cores->front() : 0;
  plan.programs = std::filesystem::read_symlink("/proc/self/exe").parent_path();
  return plan;
}

bool write_file(const std::string& path, const std::string& text) {
  std::ofstream file(path);
  file << text;
  if (file.flush()) return true;
  fmt::print(stderr, "plchost-bench: cannot write {}\n", path);
  return false;
}

/// One part in one condition.
struct Job {
  const bench::Part* part;
  bool under_stress;
};

std::vector<Job> make_jobs(const Options& options) {
  std::vector<Job> jobs;
  const bool can_stress = options.stress && bench::is_installed("stress-ng");
  if (options.stress && !can_stress)
    fmt::print(stderr, "stress-ng is not installed: what it is needed for is skipped\n");
  for (const bool under_stress : {false, true}) {
    for (const bench::Part& part : bench::all_parts()) {
      if (!options.only.empty() && std::ranges::find(options.only, part.name) == options.only.end()) continue;
      if (!under_stress || (can_stress && part.under_stress)) jobs.push_back({&part, under_stress});
    }
  }
  return jobs;
}

/// At normal priority, on all cores, until it goes. Ends by itself if the benchmark is killed.
Result<bench::Child> start_stress() {
  return bench::Child::start(
      {"stress-ng", "--quiet", "--cpu", "2", "--vm", "1", "--io", "1", "--timeout", "2h"});
}

Result<std::vector<bench::Row>> measure(const Job& job, const bench::Plan& plan) {
  std::optional<bench::Child> stress;
  if (job.under_stress) {
    auto started = start_stress();
    if (!started) return std::unexpected(std::move(started.error()));
    stress = std::move(*started);
  }
  auto rows = job.part->measure(plan);
  if (!rows) return rows;
  for (bench::Row& row : *rows) row.condition = job.under_stress ? "stress" : "idle";
  return rows;
}

bool write_plots(const Job& job, const std::string& folder, const std::vector<bench::Row>& rows) {
  const std::string_view condition = job.under_stress ? ", under stress-ng" : "";
  const std::string path =
      fmt::format("{}/{}{}.svg", folder, job.part->name, job.under_stress ? "_stress" : "");
  if (job.part->picture.title.empty()) return true;
  return write_file(path, bench::to_svg(job.part->picture, condition, rows));
}

int run(const Options& options) {
  const bench::Plan plan = make_plan(options);
  if (auto prepared = bench::prepare_process(); !prepared) {
    fmt::print(stderr, "plchost-bench: {}\n", prepared.error().describe());
    return 1;
  }
  std::error_code cannot_be_made;
  if (!options.plots.empty()) std::filesystem::create_directories(options.plots, cannot_be_made);
  const std::vector<Job> jobs = make_jobs(options);
  const auto seconds_of = [&](const Job& job) {
    return job.part->turns * std::chrono::duration<double>(plan.each).count();
  };
  double total = 0;
  for (const Job& job : jobs) total += seconds_of(job);
  fmt::print(stderr, "{} parts, about {:.0f} minutes\n", jobs.size(), total / 60 + 0.5);
  std::vector<bench::Row> rows;
  bool complete = true;
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    const bench::Part& part = *jobs[i].part;
    fmt::print(stderr, "[{}/{}] {} ({}): {}, about {:.0f} s ...\n", i + 1, jobs.size(), part.name,
               jobs[i].under_stress ? "stress" : "idle", part.about, seconds_of(jobs[i]));
    auto measured = measure(jobs[i], plan);
    if (!measured) {
      // The others are measured all the same: an hour is not given away for one of them.
      fmt::print(stderr, "plchost-bench: {}: {}\n", part.name, measured.error().describe());
      complete = false;
      continue;
    }
    if (!options.plots.empty() && !write_plots(jobs[i], options.plots, *measured)) return 1;
    std::ranges::move(*measured, std::back_inserter(rows));
    if (!options.json.empty() && !write_file(options.json, bench::to_json(rows))) return 1;
    if (!options.markdown.empty() && !write_file(options.markdown, bench::to_markdown(rows))) return 1;
  }
  fmt::print("{}", bench::to_table(rows));
  return complete ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<std::string> names;
  for (const bench::Part& part : bench::all_parts()) names.emplace_back(part.name);
  CLI::App app("Measures plchost beside the floor of this machine", "plchost-bench");
  Options options;
  app.add_option("--json", options.json, "write the figures to this file");
  app.add_option("--markdown", options.markdown, "write them to this file as tables");
  app.add_option("--plots", options.plots, "draw the figures into this folder, as SVG");
  app.add_flag("--quick", options.quick,
               "minutes instead of most of an hour: 5 s of each thing instead of 60");
  app.add_flag("--stress", options.stress, "then the same again beside stress-ng --cpu 2 --vm 1 --io 1");
  app.add_option("--seconds", options.seconds, "so many seconds of each thing")->check(CLI::Range(1, 3600));
  app.add_option("--only", options.only, fmt::format("only these parts: {}", fmt::join(names, ", ")))
      ->check(CLI::IsMember(names))
      ->delimiter(',');
  CLI11_PARSE(app, argc, argv);
  return run(options);
}
