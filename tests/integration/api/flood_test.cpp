#include <algorithm>
#include <fstream>
#include <thread>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include "api/client/control_client.hpp"
#include "tests/integration/api/test_host.hpp"

namespace plchost {
namespace {

using std::chrono::milliseconds;

/// A client that posts as fast as it can and waits for nothing: a process of its own, until this object goes.
class Flood {
 public:
  explicit Flood(const OwnDomain& domain) : pid_(::fork()) {
    if (pid_ == 0) run(domain);
  }
  Flood(const Flood&) = delete;
  Flood& operator=(const Flood&) = delete;
  ~Flood() {
    ::kill(pid_, SIGKILL);
    ::waitpid(pid_, nullptr, 0);
  }

 private:
  [[noreturn]] static void run(const OwnDomain& domain) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    const auto client = connect(domain);
    while (!client->prepare_posts("hosta", soon())) {
    }
    for (;;) (void)client->post_one("hosta", "line1", "flood");
  }
  pid_t pid_;
};

double to_ms(Duration duration) {
  return std::chrono::duration<double, std::milli>(duration).count();
}

/// How long `call` took, the one in the middle and the longest of so many.
template <class Call>
std::string figures(int times, Call call) {
  std::vector<Duration> took;
  for (int i = 0; i < times; ++i) {
    const TimePoint start = MonotonicClock::now();
    call();
    took.push_back(MonotonicClock::now() - start);
  }
  std::ranges::sort(took);
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
    const auto report = sut->post_event({"hosta", 0, "line1", "calm"}, 1, Duration::zero(), kPatience);
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

}  // namespace
}  // namespace plchost
