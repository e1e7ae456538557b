// External events over DDS at speed: a post and its acknowledgement beside a bare Cyclone DDS round trip,
// posts one way as fast as they go beside a bare writer, 50 clients at once, and one client beside others
// that flood the host.

#include <array>
#include <thread>

#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include "api/client/control_client.hpp"
#include "api/dds/domain.hpp"
#include "api/dds/error.hpp"
#include "api/dds/samples.hpp"
#include "api/dds/topics.hpp"
#include "shm/pool/object_pool.hpp"
#include "tests/bench/cell.hpp"
#include "tests/bench/parts.hpp"
#include "tests/bench/shared_board.hpp"

namespace plchost::bench {

namespace {

constexpr Duration kSlice = std::chrono::seconds(1);
constexpr std::uint32_t kClients = 50;
constexpr std::uint32_t kFloods = 3;
constexpr std::uint32_t kPostsOfEach = 200;
constexpr Duration kPatience = std::chrono::seconds(20);

enum class Job : std::uint32_t { wait, connect, post, flood, end };

/// What the processes share.
struct Board {
  std::atomic<Job> job;
  std::atomic<std::uint32_t> connected;
  std::atomic<std::uint32_t> done;
  std::atomic<std::uint64_t> echoed;  // samples that came to the bare end
  std::array<std::int64_t, kClients * kPostsOfEach> latency_ns;
};

const ApiRequest kPing{kBenchHost, 0, "probe", "ping"};

/// Processes of this program, which end when this goes.
class Processes {
 public:
  explicit Processes(Board& board) : board_(board) {}
  Processes(const Processes&) = delete;
  Processes& operator=(const Processes&) = delete;
  ~Processes() {
    board_.job.store(Job::end);
    for (const pid_t pid : pids_) {
      ::kill(pid, SIGKILL);
      ::waitpid(pid, nullptr, 0);
    }
  }
  template <class Run>
  void fork(Run run) {
    const pid_t pid = ::fork();
    if (pid == 0) {
      ::prctl(PR_SET_PDEATHSIG, SIGKILL);
      run();
      ::_exit(0);
    }
    if (pid > 0) pids_.push_back(pid);
  }

 private:
  Board& board_;
  std::vector<pid_t> pids_;
};

/// One of the clients: does what the board says.
void run_client(const DdsDomains& domains, Board& board, std::uint32_t index) {
  while (board.job.load() == Job::wait) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  dds::DomainOptions options;
  options.domain = domains.plchost;
  auto client = ControlClient::connect(options);
  if (!client) return;
  const auto post = [&] {
    const TimePoint start = MonotonicClock::now();
    const auto report = (*client)->post_event(kPing, 1, Duration::zero(), kPatience);
    return report && report->accepted == 1 ? (MonotonicClock::now() - start).count() : -1;
  };
  if (post() < 0) return;
  board.connected.fetch_add(1);
  for (Job job = Job::connect; job != Job::end; job = board.job.load()) {
    if (job == Job::post && index < kClients) {
      for (std::uint32_t i = 0; i < kPostsOfEach; ++i) board.latency_ns[index * kPostsOfEach + i] = post();
      board.done.fetch_add(1);
      index = kClients;  // only once
    } else if (job == Job::flood && index >= kClients + 1) {
      (void)(*client)->post_one(kBenchHost, "probe", "ping");
    } else {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }
}

/// One end of the floor.
struct BareEnd {
  std::shared_ptr<dds::Entity> domain;
  dds::Entity participant;
  dds::Entity event_topic;
  dds::Entity ack_topic;
  dds::Entity reader;
  dds::Entity writer;
  dds::Entity wait_set;

  Result<void> open(const DdsDomains& domains, bool echoes) {
    dds::DomainOptions options;
    options.domain = domains.bare;
    auto made = dds::open_domain(echoes ? dds::Role::server : dds::Role::client, options);
    if (!made) return std::unexpected(made.error());
    domain = std::move(*made);
    participant = dds::Entity(dds_create_participant(domains.bare, nullptr, nullptr));
    auto events = dds::make_topic(participant.get(), dds::kEvent);
    auto acks = dds::make_topic(participant.get(), dds::kEventAck);
    if (!events || !acks) return failure(ErrorCode::unavailable, "the topics of the floor cannot be made");
    event_topic = std::move(*events);
    ack_topic = std::move(*acks);
    dds::Qos event_qos = dds::event_qos();
    if (echoes) event_qos.max_samples(dds::kEventReaderDepth);
    auto from = echoes ? dds::make_reader(participant.get(), event_topic.get(), event_qos)
                       : dds::make_reader(participant.get(), ack_topic.get(), dds::ack_qos());
    auto to = echoes ? dds::make_writer(participant.get(), ack_topic.get(), dds::ack_qos())
                     : dds::make_writer(participant.get(), event_topic.get(), event_qos);
    if (!from || !to) return failure(ErrorCode::unavailable, "the ends of the floor cannot be made");
    reader = std::move(*from);
    writer = std::move(*to);
    wait_set = dds::Entity(dds_create_waitset(participant.get()));
    dds_set_status_mask(reader.get(), DDS_DATA_AVAILABLE_STATUS);
    dds_waitset_attach(wait_set.get(), reader.get(), 0);
    return {};
  }
  void wait() const {
    dds_attach_t reason = 0;
    (void)dds_waitset_wait(wait_set.get(), &reason, 1, DDS_SECS(1));
  }
  [[nodiscard]] bool matched() const {
    dds_publication_matched_status_t out{};
    dds_subscription_matched_status_t in{};
    return dds_get_publication_matched_status(writer.get(), &out) == 0 && out.current_count > 0 &&
           dds_get_subscription_matched_status(reader.get(), &in) == 0 && in.current_count > 0;
  }
};

/// The other end of the floor: acknowledges each batch, as plchost-dds does.
void run_echo(const DdsDomains& domains, Board& board) {
  BareEnd end;
  if (!end.open(domains, /*echoes=*/true)) return;
  plc_EventAck ack{};
  while (board.job.load() != Job::end) {
    end.wait();
    std::uint64_t count = 0;
    dds::take_valid<plc_EventPost>(end.reader.get(), [&](const plc_EventPost& post, const auto& /*info*/) {
      ack.sequence_number = post.sequence_number;
      ++count;
    });
    board.echoed.fetch_add(count);
    if (count > 0) (void)dds_write(end.writer.get(), &ack);
  }
}

/// The floor's client.
class BareClient {
 public:
  Result<void> open(const DdsDomains& domains) {
    if (auto opened = end_.open(domains, /*echoes=*/false); !opened) return opened;
    std::string_view(kBenchHost).copy(sample_.host, sizeof sample_.host - 1);
    std::string_view("probe").copy(sample_.instance, sizeof sample_.instance - 1);
    std::string_view("ping").copy(sample_.event, sizeof sample_.event - 1);
    return wait_until([this] { return end_.matched(); }, "the meeting of the floor's ends");
  }
  bool post() {
    sample_.sequence_number = ++last_;
    return dds_write(end_.writer.get(), &sample_) == DDS_RETCODE_OK;
  }
  void round_trip() {
    (void)post();
    for (std::uint64_t acknowledged = 0; acknowledged < last_;) {
      end_.wait();
      dds::take_valid<plc_EventAck>(end_.reader.get(), [&](const plc_EventAck& ack, const auto&) {
        acknowledged = ack.sequence_number;
      });
    }
  }

 private:
  BareEnd end_;
  plc_EventPost sample_{};
  std::uint64_t last_ = 0;
};

template <class Call>
Result<void> time_calls(Duration slice, Samples& into, Call call) {
  const TimePoint end = MonotonicClock::now() + slice;
  while (MonotonicClock::now() < end) {
    const TimePoint start = MonotonicClock::now();
    call();
    into.push(MonotonicClock::now() - start);
  }
  return {};
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

/// The measurements, once all ends are open.
class Measurement {
 public:
  Measurement(const Plan& plan, Board& board, ControlClient& client, BareClient& bare, PoolEvent event)
      : plan_(plan), board_(board), client_(client), bare_(bare), event_(event) {}

  Result<Row> round_trip() {
    Row row{.name = "post/acknowledged"};
    auto done =
        alternate(plan_,
                  {[&](Duration slice) { return time_calls(slice, row.floor, [&] { bare_.round_trip(); }); },
                   [&](Duration slice) { return time_calls(slice, row.ours, [&] { post(); }); }},
                  kSlice);
    if (!done) return std::unexpected(done.error());
    const double p50 = ratio(summarise(row.ours).p50, summarise(row.floor).p50);
    row.targets = {{"median below 1.15 x a bare Cyclone DDS round trip", p50, 1.15}};
    return row;
  }

  Result<Row> rate() {
    Row row{.name = "post/rate"};
    double ours = 0, our_seconds = 0, bare = 0, bare_seconds = 0;
    const auto post_one = [&] { return client_.post_one(kBenchHost, "probe", "ping").has_value(); };
    auto done = alternate(
        plan_,
        {[&](Duration slice) {
           return run_fast(
               slice, bare, bare_seconds, [&] { return bare_.post(); }, [&] { return board_.echoed.load(); });
         },
         [&](Duration slice) {
           return run_fast(slice, ours, our_seconds, post_one, [&] { return event_.counted().count(); });
         }},
        kSlice);
    if (!done) return std::unexpected(done.error());
    const double per_second = ours / our_seconds;
    const double floor = bare / bare_seconds;
    row.extra = {{"posts_per_second", per_second}, {"floor_posts_per_second", floor}};
    row.targets = {
        {"above 0.8 x the bare maximum, nothing lost (shown: bare by ours)", floor / per_second, 1.25}};
    return row;
  }

  Result<Row> many() {
    Row row{.name = "post/50 clients"};
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
    row.targets.push_back({"none of the acknowledged posts failed", failed, 0, /*or_equal=*/true});
    return row;
  }

  Result<Row> flood() {
    Row row{.name = "post/beside floods"};
    row.note = "floor: the same without floods";
    if (auto done = time_calls(kSlice, row.floor, [&] { post(); }); !done)
      return std::unexpected(done.error());
    const std::uint64_t before = event_.counted().count();
    const TimePoint start = MonotonicClock::now();
    board_.job.store(Job::flood);
    if (auto done = time_calls(plan_.each / 2, row.ours, [&] { post(); }); !done)
      return std::unexpected(done.error());
    Samples commands;
    const ApiRequest listing{kBenchHost, plc_OPERATION_LIST_OBJECTS, "", ""};
    if (auto done = time_calls(plan_.each / 2, commands,
                               [&] { (void)client_.call(listing, MonotonicClock::now() + kPatience); });
        !done)
      return std::unexpected(done.error());
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
  void post() { (void)client_.post_event(kPing, 1, Duration::zero(), kPatience); }

  const Plan& plan_;
  Board& board_;
  ControlClient& client_;
  BareClient& bare_;
  PoolEvent event_;
};

Result<std::vector<Row>> measure(const Plan& plan, const DdsDomains& domains, Board& board) {
  Cell cell(plan, domains, fmt::format("plchost-bench-{}", ::getpid()));
  if (auto started = cell.start(plan); !started) return std::unexpected(started.error());
  dds::DomainOptions options;
  options.domain = domains.plchost;
  auto client = ControlClient::connect(options);
  if (!client) return std::unexpected(client.error());
  const auto first = (*client)->post_event(kPing, 1, Duration::zero(), kPatience);
  if (!first) return std::unexpected(first.error());
  BareClient bare;
  if (auto opened = bare.open(domains); !opened) return std::unexpected(opened.error());
  const auto pool = ObjectPool::attach(cell.pool());
  if (!pool) return std::unexpected(pool.error());
  const auto event = pool->open_event("probe/ping");
  if (!event) return std::unexpected(event.error());
  Measurement measurement(plan, board, **client, bare, *event);
  std::vector<Row> rows;
  const auto take = [&rows](Result<Row> row) -> Result<void> {
    if (!row) return std::unexpected(row.error());
    rows.push_back(std::move(*row));
    return {};
  };
  if (auto done = take(measurement.round_trip()); !done) return std::unexpected(done.error());
  if (auto done = take(measurement.rate()); !done) return std::unexpected(done.error());
  board.job.store(Job::connect);
  const auto all_there = [&] { return board.connected.load() == kClients + kFloods; };
  if (auto done = wait_until(all_there, "the clients"); !done) return std::unexpected(done.error());
  if (auto done = take(measurement.many()); !done) return std::unexpected(done.error());
  if (auto done = take(measurement.flood()); !done) return std::unexpected(done.error());
  return rows;
}

}  // namespace

Result<std::vector<Row>> measure_post_many(const Plan& plan) {
  constexpr std::uint32_t kFirstDomain = 20;
  const auto salt = static_cast<std::uint32_t>(::getpid()) % 40U;
  const DdsDomains domains{.plchost = kFirstDomain + 2 * salt, .bare = kFirstDomain + 2 * salt + 1};
  void* const memory =
      ::mmap(nullptr, sizeof(Board), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) return failure(ErrorCode::system, "map the board", errno);
  Board& board = *new (memory) Board{};
  // What the program in the instance stamps is not looked at here, but it wants a place for it.
  const std::string stamps = fmt::format("plchost-bench-{}.board", ::getpid());
  if (const auto made = MemoryFile::replace(stamps, sizeof(DdsBoard)); !made)
    return std::unexpected(made.error());
  ::setenv(kBoardVariable, ("/dev/shm/" + stamps).c_str(), 1);
  Result<std::vector<Row>> rows;
  {
    // Forked before this process has any thread of DDS.
    Processes processes(board);
    processes.fork([&] { run_echo(domains, board); });
    for (std::uint32_t i = 0; i < kClients; ++i) processes.fork([&, i] { run_client(domains, board, i); });
    for (std::uint32_t i = 1; i <= kFloods; ++i)
      processes.fork([&, i] { run_client(domains, board, kClients + i); });
    rows = measure(plan, domains, board);
  }
  MemoryFile::remove(stamps);
  ::munmap(memory, sizeof(Board));
  return rows;
}

}  // namespace plchost::bench
