#include <algorithm>
#include <atomic>
#include <fstream>
#include <thread>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include "api/client/control_client.hpp"
#include "api/dds/domain.hpp"
#include "api/dds/text.hpp"
#include "api/dds/topics.hpp"
#include "shm/process/end_with_parent.hpp"
#include "tests/integration/api/test_host.hpp"

namespace plchost {
namespace {

using std::chrono::milliseconds;

/// A client that posts as fast as it can and waits for nothing: a process of its own, until this object goes.
class Flood {
 public:
  explicit Flood(const OwnDomain& domain) {
    const pid_t parent = ::getpid();
    pid_ = ::fork();
    if (pid_ == 0) run(domain, parent);
  }
  Flood(const Flood&) = delete;
  Flood& operator=(const Flood&) = delete;
  ~Flood() {
    ::kill(pid_, SIGKILL);
    ::waitpid(pid_, nullptr, 0);
  }

 private:
  [[noreturn]] static void run(const OwnDomain& domain, pid_t parent) {
    if (!end_with_parent(parent, SIGKILL)) ::_exit(EXIT_FAILURE);
    const auto client = connect(domain);
    while (!client->prepare_posts("hosta", soon())) {
    }
    for (;;) (void)client->post_one("hosta", "line1", "flood");
  }
  pid_t pid_ = 0;
};

double to_ms(Duration duration) {
  return std::chrono::duration<double, std::milli>(duration).count();
}

// Without a flood a post or a command takes about a millisecond. Behind the queue of a flood it would take
// seconds.
constexpr Duration kStarved = milliseconds(500);

/// How long `call` took, the one in the middle and the longest of so many. The one in the middle was not
/// starved.
template <class Call>
std::string figures(int times, Call call) {
  std::vector<Duration> took;
  for (int i = 0; i < times; ++i) {
    const TimePoint start = MonotonicClock::now();
    call();
    took.push_back(MonotonicClock::now() - start);
  }
  std::ranges::sort(took);
  EXPECT_LT(took[took.size() / 2], kStarved);
  return fmt::format("median {:.2f} ms, longest {:.2f} ms", to_ms(took[took.size() / 2]), to_ms(took.back()));
}

/// The most memory that a process ever had, MiB.
long peak_mib(pid_t pid) {
  std::ifstream status(fmt::format("/proc/{}/status", pid));
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with("VmHWM:")) return std::stol(line.substr(6)) / 1024;
  }
  return -1;
}

TEST(PostFlood, OfSomeClientsStarvesNeitherAnotherNorItsCommands) {
  const OwnDomain domain;
  constexpr int kFloods = 3;
  std::vector<std::unique_ptr<Flood>> floods;  // before this process has a second thread
  for (int i = 0; i < kFloods; ++i) floods.push_back(std::make_unique<Flood>(domain));
  TestHost host(domain, "hosta");
  host.write_instance(0, "line1", InstanceState::running, 4711);
  host.write_count(1);
  const PoolEvent flood = host.add_event("line1", "flood");
  const PoolEvent calm = host.add_event("line1", "calm");
  host.start_server();
  const auto sut = connect(domain);
  ASSERT_TRUE(sut->prepare_posts("hosta", soon()));
  const long before = peak_mib(host.server().pid());
  while (flood.counted().count() < 10'000) std::this_thread::sleep_for(milliseconds(1));
  const std::uint64_t at_start = flood.counted().count();
  const TimePoint start = MonotonicClock::now();

  constexpr int kCalm = 200;
  const std::string posts = figures(kCalm, [&] {
    const auto report = sut->post_event({"hosta", "line1", "calm"}, 1, Duration::zero(), kPatience);
    ASSERT_TRUE(report) << report.error().describe();
    ASSERT_EQ(report->accepted, 1U);
  });
  constexpr int kCommands = 50;
  const std::string commands = figures(kCommands, [&] {
    const auto reply = sut->call({"hosta", plc_OPERATION_STOP, "line1", ""}, soon());
    ASSERT_TRUE(reply) << reply.error().describe();
  });

  const double elapsed_s = to_ms(MonotonicClock::now() - start) / 1000;
  const std::uint64_t flooded = flood.counted().count() - at_start;
  fmt::print("{} floods, {:.0f} posts a second: a post and its acknowledgement {}; a command {}\n", kFloods,
             static_cast<double>(flooded) / elapsed_s, posts, commands);
  EXPECT_EQ(calm.counted().count(), static_cast<std::uint64_t>(kCalm));
  EXPECT_GT(flooded, 0U) << "the flood was over";
  EXPECT_TRUE(sut->host("hosta", soon()));
  const long after = peak_mib(host.server().pid());
  fmt::print("memory of the server: {} MiB before, {} MiB at most\n", before, after);
  EXPECT_LT(after, before + 128);
}

TEST(PostFlood, IsCountedToTheLastPost) {
  const OwnDomain domain;
  auto one = std::make_unique<Flood>(domain);
  TestHost host(domain, "hosta");
  const PoolEvent flood = host.add_event("line1", "flood");
  host.start_server();
  const auto sut = connect(domain);
  while (flood.counted().count() < 10'000) std::this_thread::sleep_for(milliseconds(1));
  one.reset();

  const auto settled = [&]() -> std::optional<plc_WriterStatus> {
    const auto writers = sut->writers("hosta", soon()).value();
    const auto gone = std::ranges::find_if(writers.begin() + 1, writers.end(),
                                           [](const plc_WriterStatus& writer) { return !writer.present; });
    return gone == writers.end() ? std::nullopt : std::optional(*gone);
  };
  while (!settled()) sut->wait_for_change(soon());
  const plc_WriterStatus writer = *settled();

  fmt::print("received {}, delivered {}, lost {}, early {}\n", writer.received, writer.delivered, writer.lost,
             writer.early);
  EXPECT_EQ(writer.received, writer.delivered + writer.rejected + writer.duplicate + writer.early);
  EXPECT_EQ(writer.delivered, flood.counted().count());
  EXPECT_EQ(writer.last_sequence, writer.delivered + writer.rejected + writer.lost);
}

/// Requests as fast as they can be written, to be answered by nobody: a process of its own.
[[noreturn]] void flood_with_requests(const OwnDomain& domain, std::atomic<std::uint64_t>& written,
                                      pid_t parent) {
  if (!end_with_parent(parent, SIGKILL)) ::_exit(EXIT_FAILURE);
  dds::DomainOptions options;
  options.domain = domain.number();
  const auto opened = dds::open_domain(dds::Role::client, options).value();
  const dds::Entity participant(dds_create_participant(domain.number(), nullptr, nullptr));
  const auto topic = dds::make_topic(participant.get(), dds::kOperatorRequest).value();
  const auto publisher = dds::make_publisher(participant.get(), dds::host_partition("hosta")).value();
  const auto writer =
      dds::make_writer(publisher.get(), topic.get(), dds::qos_of(dds::kOperatorRequest)).value();
  plc_Request request{};
  dds::guid_of(writer.get()).copy_to(request.header.request_identity.writer_guid);
  dds::copy_text(request.header.instance_name, "hosta");
  request.operation = plc_OPERATION_READ_CLOCK;
  dds_publication_matched_status_t matched{};
  while (matched.current_count == 0) (void)dds_get_publication_matched_status(writer.get(), &matched);
  for (;;) {
    ++request.header.request_identity.sequence_number;
    if (dds_write(writer.get(), &request) == DDS_RETCODE_OK) ++written;
  }
}

TEST(RequestFlood, OfSomeClientsKeepsNeitherThePresenceNorAnotherClientWaiting) {
  const OwnDomain domain;
  void* const shared = ::mmap(nullptr, sizeof(std::atomic<std::uint64_t>), PROT_READ | PROT_WRITE,
                              MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  ASSERT_NE(shared, MAP_FAILED);
  auto& written = *new (shared) std::atomic<std::uint64_t>(0);
  std::vector<pid_t> floods;
  for (int i = 0; i < 2; ++i) {
    const pid_t parent = ::getpid();
    floods.push_back(::fork());
    if (floods.back() == 0) flood_with_requests(domain, written, parent);
  }
  TestHost host(domain, "hosta");
  host.write_instance(0, "line1", InstanceState::running, 4711);
  host.write_count(1);
  const PoolEvent calm = host.add_event("line1", "calm");
  host.start_server();
  const auto sut = connect(domain);
  ASSERT_TRUE(sut->prepare_posts("hosta", soon()));
  const std::uint64_t epoch = sut->host("hosta", soon()).value().epoch;

  while (written < 1000) std::this_thread::sleep_for(milliseconds(1));
  const std::uint64_t before = written;
  const TimePoint start = MonotonicClock::now();

  const std::string posts = figures(
      100, [&] { ASSERT_TRUE(sut->post_event({"hosta", "line1", "calm"}, 1, Duration::zero(), kPatience)); });
  const std::string commands =
      figures(20, [&] { ASSERT_TRUE(sut->call({"hosta", plc_OPERATION_STOP, "line1", ""}, soon())); });

  const double rate = static_cast<double>(written - before) / to_ms(MonotonicClock::now() - start) * 1000;
  fmt::print("{} floods, {:.0f} requests a second: a post and its acknowledgement {}; a command {}\n",
             floods.size(), rate, posts, commands);
  EXPECT_GT(written, before) << "the flood was over";
  EXPECT_EQ(calm.counted().count(), 100U);
  const auto now = sut->host("hosta", soon());
  ASSERT_TRUE(now);
  EXPECT_EQ(now->epoch, epoch) << "it is still the same server";
  for (const pid_t flood : floods) {
    ::kill(flood, SIGKILL);
    ::waitpid(flood, nullptr, 0);
  }
}

}  // namespace
}  // namespace plchost
