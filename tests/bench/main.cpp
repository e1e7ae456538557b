// plchost-bench: what plchost costs, beside the floor that the machine sets in the same minute.

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <iterator>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <unistd.h>

#include "tests/bench/bench.hpp"
#include "tests/bench/plot.hpp"

namespace {

using namespace plchost;  // NOLINT(google-build-using-namespace): a program's main file

struct Options {
  std::string json;
  std::string plots;
  bool quick = false;
  std::string only;
};

bench::Plan make_plan(const Options& options) {
  bench::Plan plan;
  if (!options.quick) {
    plan.slices = 120;
    plan.slice = std::chrono::milliseconds(1000);
    plan.posts = 1000;
  }
  const auto cores = online_cores();
  // Two different cores where there are two; else everything shares the one.
  plan.task_core = cores && !cores->empty() ? cores->back() : 0;
  plan.poster_core = cores && !cores->empty() ? cores->front() : 0;
  plan.programs = std::filesystem::read_symlink("/proc/self/exe").parent_path();
  plan.progress = [](const std::string& what) { fmt::print(stderr, "measuring {} ...\n", what); };
  return plan;
}

bool write_file(const std::string& path, const std::string& text) {
  std::ofstream file(path);
  file << text;
  if (file.flush()) return true;
  fmt::print(stderr, "plchost-bench: cannot write {}\n", path);
  return false;
}

/// One picture for each part that was measured.
bool write_plots(const std::string& folder, const std::vector<bench::Row>& rows) {
  constexpr std::pair<std::string_view, std::string_view> kPictures[] = {
      {"cyclic", "start latency of a 1 ms task: share of cycles that start later"},
      {"post", "post to first instruction of the task: share of posts that take longer"}};
  for (const auto& [prefix, title] : kPictures) {
    std::vector<bench::Row> part;
    std::ranges::copy_if(rows, std::back_inserter(part),
                         [&](const auto& row) { return row.name.starts_with(prefix); });
    if (part.empty()) continue;
    if (!write_file(fmt::format("{}/{}.svg", folder, prefix), bench::to_svg(std::string(title), part)))
      return false;
  }
  return true;
}

int run(const Options& options) {
  const bench::Plan plan = make_plan(options);
  if (auto prepared = bench::prepare_process(); !prepared) {
    fmt::print(stderr, "plchost-bench: {}\n", prepared.error().describe());
    return 1;
  }
  struct Part {
    std::string_view name;
    Result<std::vector<bench::Row>> (*measure)(const bench::Plan&);
  };
  constexpr Part kParts[] = {{"cyclic", &bench::measure_cyclic},
                             {"post/process", &bench::measure_post_process},
                             {"post/dds", &bench::measure_post_dds}};
  std::vector<bench::Row> rows;
  for (const Part& part : kParts) {
    if (!options.only.empty() && options.only != part.name) continue;
    auto measured = part.measure(plan);
    if (!measured) {
      fmt::print(stderr, "plchost-bench: {}: {}\n", part.name, measured.error().describe());
      return 1;
    }
    std::ranges::move(*measured, std::back_inserter(rows));
  }
  fmt::print("{}", bench::to_table(rows));
  if (!options.json.empty() && !write_file(options.json, bench::to_json(rows))) return 1;
  if (!options.plots.empty() && !write_plots(options.plots, rows)) return 1;
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Measures plchost beside the floor of this machine", "plchost-bench");
  Options options;
  app.add_option("--json", options.json, "write the figures to this file");
  app.add_option("--plots", options.plots, "draw the figures into this folder, as SVG");
  app.add_flag("--quick", options.quick, "a few minutes instead of a quarter of an hour");
  app.add_option("--only", options.only, "one part: cyclic, post/process or post/dds");
  CLI11_PARSE(app, argc, argv);
  return run(options);
}
