// External events over DDS at speed. A post and its acknowledgement stand beside a bare Cyclone DDS round
// trip. Posts one way, as fast as they go, stand beside a bare writer and a reader that takes and counts.

#include <array>
#include <memory>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <unistd.h>

#include "api/client/control_client.hpp"
#include "shm/pool/object_pool.hpp"
#include "tests/bench/bare_ends.hpp"
#include "tests/bench/cell.hpp"
#include "tests/bench/measure_beside.hpp"
#include "tests/bench/parts.hpp"
#include "tests/support/own_name.hpp"

namespace plchost::bench {

namespace {

constexpr Duration kRateSlice = std::chrono::seconds(1);
constexpr Duration kRatePatience = std::chrono::seconds(20);
constexpr const char* kWithoutTask = "counted";

/// By BareDuty: the samples that the ends of the floor have taken.
using TakenBoard = std::array<std::atomic<std::uint64_t>, 3>;

std::uint32_t bare_domain(const DdsDomains& domains, BareDuty duty) {
  return domains.bare + std::to_underlying(duty);
}

/// Posts as fast as they go for a slice, and waits until as many have arrived as were taken.
template <class Post, class Count>
Result<void> run_fast(Duration slice, double& posts, double& seconds, Post post, Count count) {
  const std::uint64_t before = count();
  const TimePoint start = MonotonicClock::now();
  std::uint64_t taken = 0;
  while (MonotonicClock::now() < start + slice) {
    if (post()) ++taken;
  }
  auto all = wait_until([&] { return count() - before >= taken; }, "the arrival of all posts");
  posts += static_cast<double>(taken);
  seconds += std::chrono::duration<double>(MonotonicClock::now() - start).count();
  return all;
}

/// One measurement after the other, each with clients of its own.
class RateMeasurement {
 public:
  RateMeasurement(const Plan& plan, const DdsDomains& domains, TakenBoard& board)
      : plan_(plan), domains_(domains), board_(board) {}

  /// From a client on the core of plchost-dds, or on the task's.
  Result<Row> round_trip(const std::string& name, int core) {
    const OnCore threads_inherit_it(core);
    PLCHOST_TRY(open(BareDuty::acknowledge));
    Row row{.name = name, .sample = "a post and its acknowledgement"};
    const auto post = [&] { (void)client_->post_event(ping_event(), 1, Duration::zero(), kRatePatience); };
    const auto measure_floor = [&](Duration slice) -> Result<void> {
      time_calls(slice, row.floor, [&] { bare_->round_trip(); });
      return {};
    };
    const auto measure_ours = [&](Duration slice) -> Result<void> {
      time_calls(slice, row.ours, post);
      return {};
    };
    PLCHOST_TRY(alternate(plan_, {measure_floor, measure_ours}, kRateSlice));
    const double p50 = ratio(summarise(row.ours).p50, summarise(row.floor).p50);
    row.targets = {{"median below 1.15 x a bare Cyclone DDS round trip", "ratio", p50, 1.15}};
    return row;
  }

  Result<Row> rate(const std::string& name, BareDuty duty, const std::string& event_name,
                   const PoolEvent& event) {
    PLCHOST_TRY(open(duty));
    Row row{.name = name, .sample = "none: rates"};
    double ours = 0, our_seconds = 0, bare = 0, bare_seconds = 0;
    const auto post_one = [&] { return client_->post_one(kBenchHost, "probe", event_name).has_value(); };
    const auto measure_floor = [&](Duration slice) {
      const auto& taken = board_[std::to_underlying(duty)];
      return run_fast(slice, bare, bare_seconds, [&] { return bare_->post(); }, [&] { return taken.load(); });
    };
    const auto measure_ours = [&](Duration slice) {
      return run_fast(slice, ours, our_seconds, post_one, [&] { return event.counted().count(); });
    };
    PLCHOST_TRY(alternate(plan_, {measure_floor, measure_ours}, kRateSlice));
    const double per_second = ours / our_seconds;
    const double floor = bare / bare_seconds;
    row.extra = {{"posts_per_second", per_second}, {"floor_posts_per_second", floor}};
    row.targets = {{"above 0.8 x the bare maximum, nothing lost (shown: bare by ours)", "ratio",
                    floor / per_second, 1.25}};
    return row;
  }

 private:
  // DDS's threads inherit the core of the thread that opens a domain: each measurement has domains and
  // clients anew.
  Result<void> open(BareDuty duty) {
    client_.reset();
    bare_.reset();
    dds::DomainOptions options;
    options.domain = domains_.plchost;
    PLCHOST_TRY_ASSIGN(auto client, ControlClient::connect(options));
    const auto first = client->post_event(ping_event(), 1, Duration::zero(), kRatePatience);
    if (!first) return std::unexpected(first.error());
    client_ = std::move(client);
    return bare_.emplace().open(bare_domain(domains_, duty));
  }

  const Plan& plan_;
  const DdsDomains& domains_;
  TakenBoard& board_;
  std::unique_ptr<ControlClient> client_;
  std::optional<BareClient> bare_;
};

Result<std::vector<Row>> measure_rate(const Plan& plan, const DdsDomains& domains, TakenBoard& board) {
  Cell cell(plan, domains, own_name("bench"));
  PLCHOST_TRY(cell.start(plan));
  PLCHOST_TRY_ASSIGN(auto pool, ObjectPool::attach(cell.pool()));
  PLCHOST_TRY_ASSIGN(const auto ping, pool.open_event("probe/ping"));
  PLCHOST_TRY_ASSIGN(const auto counted, pool.create_event(fmt::format("probe/{}", kWithoutTask)));
  (void)counted.set_registered(true);
  RateMeasurement measurement(plan, domains, board);
  std::vector<Row> rows;
  for (auto row : {measurement.round_trip("post/acknowledged/same-core", plan.poster_core),
                   measurement.round_trip("post/acknowledged/other-core", plan.task_core),
                   measurement.rate("post/rate", BareDuty::nothing, kWithoutTask, counted),
                   measurement.rate("post/rate/a task runs", BareDuty::wake, "ping", ping)}) {
    if (!row) return std::unexpected(row.error());
    rows.push_back(std::move(*row));
  }
  return rows;
}

}  // namespace

Result<std::vector<Row>> measure_post_rate(const Plan& plan) {
  constexpr std::uint32_t kFirstDomain = 20;
  const auto salt = static_cast<std::uint32_t>(::getpid()) % 40U;
  const DdsDomains domains{.plchost = kFirstDomain + 4 * salt, .bare = kFirstDomain + 4 * salt + 1};
  return measure_beside<TakenBoard>(
      [&](Processes& processes, TakenBoard& board) {
        for (const auto duty : {BareDuty::nothing, BareDuty::acknowledge, BareDuty::wake}) {
          processes.fork([&, duty] {
            run_bare_end(plan, bare_domain(domains, duty), duty, board[std::to_underlying(duty)]);
          });
        }
      },
      [&](TakenBoard& board) { return measure_rate(plan, domains, board); });
}

}  // namespace plchost::bench
