// Start latency of a 1 ms task in Structured Text, in a plc-instance under each scheduler. It is the time
// from the planned release to the first instruction of the task, as the instance counts it. plcctl builds the
// program by each compiler that is there. Beside it F, in alternation.

#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <thread>

#include <fmt/format.h>

#include "schedulers/policies/registry.hpp"
#include "shm/pages/instance_page.hpp"
#include "shm/pool/object_pool.hpp"
#include "tests/bench/child.hpp"
#include "tests/bench/cyclic_loop.hpp"
#include "tests/bench/parts.hpp"
#include "tests/support/own_name.hpp"

namespace plchost::bench {

namespace {

constexpr auto kInstancePatience = std::chrono::seconds(10);
constexpr std::string_view kInstance = "text";

/// Inputs, outputs, a timer and a little work, as a small control program has them.
constexpr std::string_view kProgram = R"(
PROGRAM Main
  VAR raw AT %IW0 : INT; total AT %QD0 : DINT; lamp AT %QX4.0 : BOOL; END_VAR
  VAR late : TON; i : DINT; END_VAR
  late(IN := raw >= 0, PT := T#20ms);
  lamp := late.Q;
  FOR i := 1 TO 10 DO total := total + i * INT_TO_DINT(raw); END_FOR;
END_PROGRAM
CONFIGURATION bench
  RESOURCE text ON PLC
    TASK cycle (INTERVAL := T#1ms, PRIORITY := 0);
    PROGRAM one WITH cycle : Main;
  END_RESOURCE
END_CONFIGURATION
)";

struct IecCompiler {
  const char* name;      ///< for --compiler
  const char* variable;  ///< of the environment, with its folder
};
constexpr std::array kIecCompilers{IecCompiler{.name = "matiec", .variable = "PLCHOST_MATIEC"},
                                   IecCompiler{.name = "strucpp", .variable = "PLCHOST_STRUCPP"}};

bool is_there(const IecCompiler& compiler) {
  const char* const folder = std::getenv(compiler.variable);  // NOLINT(concurrency-mt-unsafe): one thread
  return folder != nullptr && *folder != '\0';
}

/// How often each bucket of the latencies was counted.
std::vector<std::uint64_t> counts_of(const InstancePageReader& page) {
  const HistogramView histogram = page.histogram(0, TaskHistogram::latency);
  std::vector<std::uint64_t> counts(histogram.shape().bucket_count());
  for (std::size_t i = 0; i < counts.size(); ++i) counts[i] = histogram.count(i);
  return counts;
}

/// The least ratios of the four peers in README.md, of the first instruction and of p99.
std::vector<Target> targets_for(const Samples& latencies, const Samples& floor) {
  constexpr double kPeersMedian = 1.9;
  constexpr double kPeersP99 = 1.9;
  const Summary ours = summarise(latencies);
  const Summary bare = summarise(floor);
  return {{"median below 1.9 F, which is the best of the peers", "us", ours.p50, kPeersMedian * bare.p50},
          {"p99 below 1.9 F, which is the best of the peers", "us", ours.p99, kPeersP99 * bare.p99}};
}

Result<InstancePageReader> page_of(pid_t pid, const std::string& pool) {
  const TimePoint begin = MonotonicClock::now();
  for (;;) {
    auto page = InstancePageReader::open(pool, kInstance);
    const auto runtime = page ? page->runtime() : std::nullopt;
    if (runtime && runtime->pid == pid && runtime->running != 0) return page;
    if (MonotonicClock::now() - begin > kInstancePatience)
      return failure(ErrorCode::timed_out, "plc-instance does not run the program in Structured Text");
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

struct TextTask {
  std::string application;
  std::string_view compiler;
  std::string_view scheduler;
  Samples latencies = {};
};

Result<void> measure_slice(const Plan& plan, const std::string& pool, TextTask& task, Duration slice) {
  auto child = Child::start({(plan.programs / "plc-instance").string(), fmt::format("--name={}", kInstance),
                             "--pool=" + pool, fmt::format("--core={}", plan.task_core),
                             fmt::format("--scheduler={}", task.scheduler), "--log-level=error",
                             "--application=" + task.application});
  if (!child) return std::unexpected(std::move(child.error()));
  PLCHOST_TRY_ASSIGN(const auto page, page_of(child->pid(), pool));
  std::this_thread::sleep_for(kWarmUp);
  const std::vector<std::uint64_t> before = counts_of(page);
  std::this_thread::sleep_for(slice);
  const std::vector<std::uint64_t> after = counts_of(page);
  for (std::size_t i = 0; i < after.size(); ++i) {
    for (std::uint64_t n = before[i]; n < after[i]; ++n)
      task.latencies.push(page.histogram_shape().lower_edge(i));
  }
  return {};
}

/// The application that the compiler makes of it, in `folder`.
Result<std::string> build(const Plan& plan, const IecCompiler& compiler, const std::string& folder) {
  const std::string source = folder + "/bench.st";
  std::ofstream(source) << kProgram;
  const std::string made = fmt::format("{}/{}.so", folder, compiler.name);
  auto output = output_of({(plan.programs / "plcctl").string(), "build", "application", source, "-o", made,
                           "--compiler", compiler.name});
  if (!output) return std::unexpected(std::move(output.error()));
  return made;
}

Result<void> measure_all(const Plan& plan, const std::string& pool, std::vector<TextTask>& tasks,
                         CyclicFigures& floor) {
  BareLoop bare(Wait::sleep, kCyclePeriod);
  std::vector<Subject> subjects{slices_of(plan, bare, kCyclePeriod, floor)};
  for (TextTask& task : tasks)
    subjects.emplace_back([&](Duration slice) { return measure_slice(plan, pool, task, slice); });
  return alternate(plan, subjects);
}

/// A folder for the program, which goes with this.
class OwnFolder {
 public:
  explicit OwnFolder(const std::string& name) : path_(std::filesystem::temp_directory_path() / name) {
    std::filesystem::create_directory(path_);
  }
  OwnFolder(const OwnFolder&) = delete;
  OwnFolder& operator=(const OwnFolder&) = delete;
  ~OwnFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  [[nodiscard]] std::string path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace

Result<std::vector<Row>> measure_structured_text(const Plan& plan) {
  const std::string pool = own_name("bench");
  const OwnFolder folder(pool);
  std::vector<Row> rows;
  std::vector<TextTask> tasks;
  for (const IecCompiler& compiler : kIecCompilers) {
    if (!is_there(compiler)) {
      rows.push_back({.name = fmt::format("structured_text/{}", compiler.name),
                      .sample = "a cycle",
                      .note = fmt::format("skipped: {} names no folder of a compiler", compiler.variable)});
      continue;
    }
    PLCHOST_TRY_ASSIGN(const auto application, build(plan, compiler, folder.path()));
    for (const auto& entry : all_schedulers())
      tasks.push_back({.application = application, .compiler = compiler.name, .scheduler = entry.name});
  }
  CyclicFigures floor;
  const Result<void> measured = tasks.empty() ? Result<void>() : measure_all(plan, pool, tasks, floor);
  InstancePage::remove(pool, kInstance);
  ObjectPool::remove(pool);
  if (!measured) return std::unexpected(measured.error());
  for (const TextTask& task : tasks) {
    rows.push_back(
        {.name = fmt::format("structured_text/{}/{}/1ms", task.compiler, task.scheduler),
         .sample = "a cycle",
         .ours = task.latencies,
         .floor = floor.latencies,
         .extra = {{"floor_lost_per_million", floor.lost_per_million()}},
         .targets = targets_for(task.latencies, floor.latencies),
         .note = "within 0.1 %: from the histogram of the instance. The README has figures of peers"});
  }
  return rows;
}

}  // namespace plchost::bench
