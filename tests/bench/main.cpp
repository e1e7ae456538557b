// plchost-bench: what plchost costs, beside the floor that the machine sets in the same minute.

#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <fstream>
#include <iterator>

#include "tests/bench/bench.hpp"

namespace {

using namespace plchost;  // NOLINT(google-build-using-namespace): a program's main file

struct Options {
  std::string json;
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
  if (options.json.empty()) return 0;
  std::ofstream file(options.json);
  file << bench::to_json(rows);
  if (!file.flush()) {
    fmt::print(stderr, "plchost-bench: cannot write {}\n", options.json);
    return 1;
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Measures plchost beside the floor of this machine", "plchost-bench");
  Options options;
  app.add_option("--json", options.json, "write the figures to this file");
  app.add_flag("--quick", options.quick, "a few minutes instead of a quarter of an hour");
  app.add_option("--only", options.only, "one part: cyclic, post/process or post/dds");
  CLI11_PARSE(app, argc, argv);
  return run(options);
}
