// 1,000 variables of a running instance are read ten times a second, as the API server reads them. Measured
// are the start latency of its 1 ms task, and the processor time of its process. The floor is the same
// instance while nobody reads, in alternation.

#include <filesystem>
#include <thread>
#include <vector>

#include <fmt/format.h>

#include "schedulers/policies/registry.hpp"
#include "shm/pages/instance_page.hpp"
#include "shm/pool/object_pool.hpp"
#include "shm/variables/symbol_page.hpp"
#include "shm/variables/value_message.hpp"
#include "tests/bench/cell.hpp"
#include "tests/bench/child.hpp"
#include "tests/bench/parts.hpp"
#include "tests/bench/process_usage.hpp"
#include "tests/bench/watched_variables.hpp"
#include "tests/support/own_name.hpp"
#include "tests/support/receive_until.hpp"

namespace plchost::bench {

namespace {

constexpr Duration kEach = std::chrono::milliseconds(100);
constexpr std::string_view kName = "watched";
static_assert(kWatchedVariables <= kMaxRequestedValues);

/// Of one instance, with or without a watch.
struct WatchFigures {
  Samples latencies;
  Duration cpu{};
  Duration measured{};
  std::uint64_t samples = 0;
  std::uint64_t inconsistent = 0;

  [[nodiscard]] double share() const { return ratio(to_us(cpu), to_us(measured)); }
};

/// The instance, and its variables as the API server sees them.
class Watched {
 public:
  static Result<std::unique_ptr<Watched>> start(const Plan& plan, std::string_view scheduler) {
    std::unique_ptr<Watched> self(new Watched);
    const std::filesystem::path applications = plan.programs.parent_path() / "applications";
    PLCHOST_TRY_ASSIGN(
        self->process_,
        Child::start({(plan.programs / "plc-instance").string(), fmt::format("--name={}", kName),
                      "--pool=" + self->pool_, "--run-directory=" + self->folder_.string(),
                      fmt::format("--core={}", plan.task_core), fmt::format("--scheduler={}", scheduler),
                      "--log-level=error",
                      "--application=" + (applications / "bench_variables.so").string()}));
    PLCHOST_TRY(wait_until([&] { return self->is_up(); }, "the start of the watched instance"));
    for (std::uint32_t i = 0; i < self->table_->symbols().size(); ++i)
      self->request_.elements.push_back({.symbol = i, .element = 0});
    self->request_.stream = self->table_->stream();
    return self;
  }
  Watched(const Watched&) = delete;
  Watched& operator=(const Watched&) = delete;
  ~Watched() {
    process_.end();
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
    ObjectPool::remove(pool_);
  }

  /// `watch`: whether its variables are read meanwhile.
  Result<void> measure(Duration slice, bool watch, WatchFigures& into) {
    std::this_thread::sleep_for(kWarmUp);
    const std::vector<std::uint32_t> before = buckets();
    PLCHOST_TRY_ASSIGN(const Duration cpu_before, processor_time_of(process_.pid()));
    const TimePoint begin = MonotonicClock::now();
    for (TimePoint next = begin; next + kEach <= begin + slice; next += kEach) {
      if (watch) PLCHOST_TRY(sample(into));
      std::this_thread::sleep_until(next + kEach);
    }
    PLCHOST_TRY_ASSIGN(const Duration cpu, processor_time_of(process_.pid()));
    into.cpu += cpu - cpu_before;
    into.measured += MonotonicClock::now() - begin;
    const std::vector<std::uint32_t> now = buckets();
    for (std::size_t i = 0; i < now.size(); ++i) {
      for (std::uint32_t count = before[i]; count < now[i]; ++count)
        into.latencies.push(page_->histogram_shape().upper_edge(i));
    }
    return {};
  }

 private:
  Watched() : pool_(own_name("bench")), folder_(std::filesystem::temp_directory_path() / pool_) {
    std::filesystem::create_directories(folder_);
  }

  bool is_up() {
    auto page = InstancePageReader::open(pool_, kName);
    const auto runtime = page ? page->runtime() : std::nullopt;
    if (!runtime || runtime->running != 1) return false;
    auto socket = PacketSocket::connect(values_socket_path(folder_.string(), kName));
    auto table = SymbolTable::open(pool_, kName);
    if (!socket || !table || table->symbols().size() != kWatchedVariables) return false;
    page_.emplace(*std::move(page));
    socket_ = *std::move(socket);
    table_.emplace(*std::move(table));
    return true;
  }

  Result<void> sample(WatchFigures& into) {
    ++request_.number;
    PLCHOST_TRY(socket_.send(encode(request_)));
    std::optional<ValueReply> reply;
    while (!reply) {
      PLCHOST_TRY_ASSIGN(const auto packet, receive_until(socket_, MonotonicClock::now() + kCellPatience));
      PLCHOST_TRY_ASSIGN(reply, reader_.take(packet));
    }
    if (reply->code != ErrorCode::ok || reply->elements.size() != kWatchedVariables)
      return failure(ErrorCode::system, "the watched instance does not tell its values");
    ++into.samples;
    if (!reply->consistent) ++into.inconsistent;
    return {};
  }

  [[nodiscard]] std::vector<std::uint32_t> buckets() const {
    const HistogramView latency = page_->histogram(0, TaskHistogram::latency);
    std::vector<std::uint32_t> counts(latency.shape().bucket_count());
    for (std::size_t i = 0; i < counts.size(); ++i) counts[i] = latency.count(i);
    return counts;
  }

  std::string pool_;
  std::filesystem::path folder_;
  Child process_;
  std::optional<InstancePageReader> page_;
  PacketSocket socket_;
  std::optional<SymbolTable> table_;
  ValueReplyReader reader_;
  ValueRequest request_;
};

Row row_of(std::string_view scheduler, const WatchFigures& with, const WatchFigures& without) {
  const double p99 = summarise(with.latencies).p99;
  const double floor = summarise(without.latencies).p99;
  return {.name = fmt::format("variables/{}/1000at10Hz", scheduler),
          .sample = "a cycle",
          .ours = with.latencies,
          .floor = without.latencies,
          .extra = {{"share", with.share()},
                    {"floor_share", without.share()},
                    {"samples_of_values", static_cast<double>(with.samples)},
                    {"inconsistent", static_cast<double>(with.inconsistent)}},
          .targets = {{"reading costs below 1 % of the core", "share", with.share() - without.share(), 0.01},
                      {"p99 at most 1.1 times that without", "us", p99, 1.1 * floor, true}},
          .note = "1,000 variables read in one sample, 10 times a second; floor: the same instance, unread"};
}

}  // namespace

Result<std::vector<Row>> measure_variables(const Plan& plan) {
  std::vector<Row> rows;
  const OnCore out_of_the_way(plan.poster_core);
  for (const auto& scheduler : all_schedulers()) {
    PLCHOST_TRY_ASSIGN(const auto watched, Watched::start(plan, scheduler.name));
    WatchFigures with;
    WatchFigures without;
    PLCHOST_TRY(alternate(plan, {[&](Duration slice) { return watched->measure(slice, false, without); },
                                 [&](Duration slice) { return watched->measure(slice, true, with); }}));
    rows.push_back(row_of(scheduler.name, with, without));
  }
  return rows;
}

}  // namespace plchost::bench
