// plchost-bench: the costs of plchost, beside the floor that the machine sets in the same minute.

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <optional>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <unistd.h>

#include "tests/bench/child.hpp"
#include "tests/bench/machine_watch.hpp"
#include "tests/bench/parts.hpp"
#include "tests/bench/plot.hpp"

namespace {

using namespace plchost;  // NOLINT(google-build-using-namespace): a program's main file

/// With --quick: the whole run, with all that it starts and ends, takes less than four minutes.
constexpr double kSetUpSeconds = 1;  // of a part, about
constexpr Duration kQuickEach = std::chrono::milliseconds(800);
constexpr int kQuickRounds = 2;

struct Options {
  std::string json;
  std::string plots;
  bool quick = false;
  bool stress = false;
  int seconds = 60;
  int rounds = 3;
  int hosts = 0;  // the default of the plan
  std::vector<std::string> only;
};

/// Of one round.
bench::Plan make_plan(const Options& options) {
  bench::Plan plan;
  plan.each = std::chrono::seconds(options.seconds);
  if (options.quick) {
    plan.each = kQuickEach;
    plan.starts = 30;
    plan.objects = 10'000;
    plan.hosts = 8;
  }
  if (options.hosts > 0) plan.hosts = options.hosts;
  plan.each /= options.rounds;
  plan.starts = std::max(plan.starts / options.rounds, 1);
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
    fmt::print(stderr, "stress-ng is not installed: the parts that need it are skipped\n");
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
    PLCHOST_TRY_ASSIGN(stress, start_stress());
  }
  const bench::MachineWatch machine;
  auto rows = job.part->measure(plan);
  if (!rows) return rows;
  for (bench::Row& row : *rows) {
    row.condition = job.under_stress ? "stress" : "idle";
    row.conditions = machine.conditions();
    row.conditions.emplace_back("each_s", std::chrono::duration<double>(plan.each).count());
  }
  return rows;
}

bool write_plots(const Job& job, const std::string& folder, const std::vector<bench::Row>& rows) {
  const std::string_view condition = job.under_stress ? ", under stress-ng" : "";
  const std::string path =
      fmt::format("{}/{}{}.svg", folder, job.part->name, job.under_stress ? "_stress" : "");
  if (job.part->picture.title.empty()) return true;
  return write_file(path, bench::to_svg(job.part->picture, condition, rows));
}

/// All that was measured so far, by job.
class Figures {
 public:
  Figures(const Options& options, std::vector<Job> jobs)
      : options_(options), jobs_(std::move(jobs)), rows_(jobs_.size()) {}

  [[nodiscard]] bool add(std::size_t job, std::vector<bench::Row> round) {
    bench::add_round(rows_[job], std::move(round));
    if (!options_.plots.empty() && !write_plots(jobs_[job], options_.plots, rows_[job])) return false;
    return options_.json.empty() || write_file(options_.json, bench::to_json(all()));
  }
  [[nodiscard]] std::vector<bench::Row> all() const {
    std::vector<bench::Row> all;
    for (const auto& rows : rows_) all.insert(all.end(), rows.begin(), rows.end());
    return all;
  }

 private:
  const Options& options_;
  std::vector<Job> jobs_;
  std::vector<std::vector<bench::Row>> rows_;
};

/// One turn of all jobs.
bool run_round(const std::vector<Job>& jobs, int round, const bench::Plan& plan, Figures& figures) {
  bool complete = true;
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    const bench::Part& part = *jobs[i].part;
    const TimePoint began = MonotonicClock::now();
    fmt::print(stderr, "round {}, [{}/{}] {} ({}): {} ...", round + 1, i + 1, jobs.size(), part.name,
               jobs[i].under_stress ? "stress" : "idle", part.about);
    auto measured = measure(jobs[i], plan);
    fmt::print(stderr, " {:.1f} s\n", std::chrono::duration<double>(MonotonicClock::now() - began).count());
    if (!measured) {
      // The others are measured all the same: an hour is not given away for one of them.
      fmt::print(stderr, "plchost-bench: {}: {}\n", part.name, measured.error().describe());
      complete = false;
    } else if (!figures.add(i, std::move(*measured))) {
      return false;
    }
  }
  return complete;
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
  double total = 0;
  for (const Job& job : jobs) {
    total +=
        options.rounds * (kSetUpSeconds + job.part->turns * std::chrono::duration<double>(plan.each).count());
  }
  fmt::print(stderr, "{} parts in {} rounds, about {:.0f} minutes\n", jobs.size(), options.rounds,
             total / 60 + 0.5);
  Figures figures(options, jobs);
  bool complete = true;
  for (int round = 0; round < options.rounds; ++round) {
    complete = run_round(jobs, round, plan, figures) && complete;
  }
  fmt::print("{}", bench::to_json(figures.all()));
  (void)std::fflush(stdout);
  fmt::print(stderr, "{}", bench::to_table(figures.all()));
  return complete ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<std::string> names;
  for (const bench::Part& part : bench::all_parts()) names.emplace_back(part.name);
  CLI::App app("Measures plchost beside the floor of this machine", "plchost-bench");
  Options options;
  app.footer("Standard output is a JSON array; text for people is on standard error.");
  app.add_option("--json", options.json, "write the array to this file, too, after each part");
  app.add_option("--plots", options.plots, "draw the figures into this folder, as SVG");
  app.add_flag("--quick", options.quick,
               "four minutes instead of most of two hours: 0.8 s of each thing, in two rounds");
  app.add_flag("--stress", options.stress, "then the same again beside stress-ng --cpu 2 --vm 1 --io 1");
  app.add_option("--seconds", options.seconds, "so many seconds of each thing, all rounds together")
      ->check(CLI::Range(1, 3600))
      ->capture_default_str()
      ->excludes("--quick");
  const CLI::Option* const rounds =
      app.add_option("--rounds", options.rounds,
                     "all parts are measured so often, one after the other; 2 with --quick, if not given")
          ->check(CLI::Range(1, 100))
          ->capture_default_str();
  app.add_option("--hosts", options.hosts, "of the fleet; 24, or 8 with --quick, if not given")
      ->check(CLI::Range(1, 200));
  app.add_option("--only", options.only, fmt::format("only these parts: {}", fmt::join(names, ", ")))
      ->check(CLI::IsMember(names))
      ->delimiter(',');
  CLI11_PARSE(app, argc, argv);
  if (options.quick && rounds->empty()) options.rounds = kQuickRounds;
  return run(options);
}
