// External events over DDS of many: 50 clients at once, and one client beside others that flood the host.

#include <array>
#include <thread>

#include <fmt/format.h>
#include <unistd.h>

#include "api/client/control_client.hpp"
#include "shm/pool/object_pool.hpp"
#include "tests/bench/cell.hpp"
#include "tests/bench/measure_beside.hpp"
#include "tests/bench/parts.hpp"
#include "tests/support/own_name.hpp"

namespace plchost::bench {

namespace {

constexpr Duration kPostManySlice = std::chrono::seconds(1);
constexpr std::uint32_t kClients = 50;
constexpr std::uint32_t kFloods = 3;
constexpr std::uint32_t kPostsOfEach = 200;
constexpr Duration kClientPatience = std::chrono::seconds(20);

enum class Job : std::uint32_t { wait, connect, post, flood, end };

/// The memory that the processes share.
struct ClientBoard {
  std::atomic<Job> job;
  std::atomic<std::uint32_t> connected;
  std::atomic<std::uint32_t> done;
  std::array<std::int64_t, std::size_t{kClients} * kPostsOfEach> latency_ns;
};

/// One of the clients: does what the board says.
void run_client(const DdsDomains& domains, ClientBoard& board, std::uint32_t index) {
  while (board.job.load() == Job::wait) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  dds::DomainOptions options;
  options.domain = domains.plchost;
  auto client = ControlClient::connect(options);
  if (!client) return;
  const auto post = [&] {
    const TimePoint start = MonotonicClock::now();
    const auto report = (*client)->post_event(ping_event(), 1, Duration::zero(), kClientPatience);
    return report && report->accepted == 1 ? (MonotonicClock::now() - start).count() : -1;
  };
  if (post() < 0) return;
  board.connected.fetch_add(1);
  for (Job job = Job::connect; job != Job::end; job = board.job.load()) {
    if (job == Job::post && index < kClients) {
      for (std::uint32_t i = 0; i < kPostsOfEach; ++i) board.latency_ns[index * kPostsOfEach + i] = post();
      client->reset();  // not in the way of what comes next
      board.done.fetch_add(1);
      return;
    } else if (job == Job::flood && index >= kClients + 1) {
      (void)(*client)->post_one(kBenchHost, "probe", "ping");
    } else {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }
}

/// The measurements, once all ends are open.
class Measurement {
 public:
  Measurement(const Plan& plan, ClientBoard& board, ControlClient& client, PoolEvent event)
      : plan_(plan), board_(board), client_(client), event_(event) {}

  Result<Row> many() {
    Row row{.name = "post/50 clients", .sample = "a post and its acknowledgement"};
    const TimePoint start = MonotonicClock::now();
    board_.job.store(Job::post);
    if (auto done = wait_until([&] { return board_.done.load() == kClients; }, "the posts of 50 clients");
        !done)
      return std::unexpected(done.error());
    const auto took = std::chrono::duration<double>(MonotonicClock::now() - start).count();
    double failed = 0;
    for (const std::int64_t latency : board_.latency_ns) {
      if (latency < 0)
        ++failed;
      else
        row.ours.push(Duration(latency));
    }
    row.extra = {{"posts_per_second", kClients * kPostsOfEach / took}, {"failed", failed}};
    row.targets.push_back({"none of the acknowledged posts failed", "posts", failed, 0, /*or_equal=*/true});
    return row;
  }

  Result<Row> flood() {
    Row row{.name = "post/beside floods", .sample = "a post and its acknowledgement"};
    row.note = "floor: the same without floods";
    time_calls(kPostManySlice, row.floor, [&] { post(); });
    const std::uint64_t before = event_.counted().count();
    const TimePoint start = MonotonicClock::now();
    board_.job.store(Job::flood);
    time_calls(plan_.each / 2, row.ours, [&] { post(); });
    Samples commands;
    const ApiRequest listing{kBenchHost, plc_OPERATION_LIST_OBJECTS, "", ""};
    time_calls(plan_.each / 2, commands,
               [&] { (void)client_.call(listing, MonotonicClock::now() + kClientPatience); });
    board_.job.store(Job::connect);
    const auto took = std::chrono::duration<double>(MonotonicClock::now() - start).count();
    const Summary asked = summarise(commands);
    row.extra = {{"flood_posts_per_second", static_cast<double>(event_.counted().count() - before) / took},
                 {"command_p50_us", asked.p50},
                 {"command_p99_us", asked.p99},
                 {"command_max_us", asked.max}};
    return row;
  }

 private:
  void post() { (void)client_.post_event(ping_event(), 1, Duration::zero(), kClientPatience); }

  const Plan& plan_;
  ClientBoard& board_;
  ControlClient& client_;
  PoolEvent event_;
};

Result<std::vector<Row>> measure(const Plan& plan, const DdsDomains& domains, ClientBoard& board) {
  Cell cell(plan, domains, own_name("bench"));
  PLCHOST_TRY(cell.start(plan));
  dds::DomainOptions options;
  options.domain = domains.plchost;
  PLCHOST_TRY_ASSIGN(auto client, ControlClient::connect(options));
  const auto first = client->post_event(ping_event(), 1, Duration::zero(), kClientPatience);
  if (!first) return std::unexpected(first.error());
  PLCHOST_TRY_ASSIGN(const auto pool, ObjectPool::attach(cell.pool()));
  PLCHOST_TRY_ASSIGN(const auto event, pool.open_event("probe/ping"));
  Measurement measurement(plan, board, *client, event);
  std::vector<Row> rows;
  const auto take = [&rows](Result<Row> row) -> Result<void> {
    if (!row) return std::unexpected(row.error());
    rows.push_back(std::move(*row));
    return {};
  };
  board.job.store(Job::connect);
  const auto all_there = [&] { return board.connected.load() == kClients + kFloods; };
  PLCHOST_TRY(wait_until(all_there, "the clients"));
  PLCHOST_TRY(take(measurement.many()));
  PLCHOST_TRY(take(measurement.flood()));
  return rows;
}

}  // namespace

Result<std::vector<Row>> measure_post_many(const Plan& plan) {
  constexpr std::uint32_t kFirstDomain = 20;
  const auto salt = static_cast<std::uint32_t>(::getpid()) % 40U;
  const DdsDomains domains{.plchost = kFirstDomain + 2 * salt, .bare = kFirstDomain + 2 * salt + 1};
  return measure_beside<ClientBoard>(
      [&](Processes& processes, ClientBoard& board) {
        for (std::uint32_t i = 0; i < kClients; ++i)
          processes.fork([&, i] { run_client(domains, board, i); });
        for (std::uint32_t i = 1; i <= kFloods; ++i)
          processes.fork([&, i] { run_client(domains, board, kClients + i); });
      },
      [&](ClientBoard& board) { return measure(plan, domains, board); });
}

}  // namespace plchost::bench
