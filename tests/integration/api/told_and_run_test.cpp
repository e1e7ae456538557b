// The answer to a post, and the cycles of a real plc-instance for it, while that is stopped, started and
// switched.
#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include <fcntl.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <sys/mman.h>
#include <unistd.h>

#include "instances/launch/launch_contract.hpp"
#include "shm/sockets/packet_socket.hpp"
#include "shm/threads/thread.hpp"
#include "tests/integration/api/test_host.hpp"
#include "tests/support/receive_until.hpp"

namespace plchost {
namespace {

using std::chrono::microseconds;

void bind_this_thread(const std::vector<int>& cores) {
  cpu_set_t set;
  CPU_ZERO(&set);
  for (const int core : cores) CPU_SET(static_cast<std::size_t>(core), &set);
  ::sched_setaffinity(0, sizeof set, &set);
}

/// The instance "line1" of a host, whose tasks count their runs.
class CountingInstance {
 public:
  static constexpr std::size_t kEvents = 32;

  /// `cores`: it may run on these.
  CountingInstance(TestHost& host, const std::vector<int>& cores)
      : host_(host), file_(host.run_directory() + "/runs") {
    std::ofstream(file_).close();
    std::filesystem::resize_file(file_, kEvents * sizeof(std::uint64_t));
    const int file = ::open(file_.c_str(), O_RDONLY | O_CLOEXEC);
    runs_ = static_cast<const std::atomic<std::uint64_t>*>(
        ::mmap(nullptr, kEvents * sizeof(std::uint64_t), PROT_READ, MAP_SHARED, file, 0));
    ::close(file);
    ::setenv("COUNTED_RUNS", file_.c_str(), 1);
    process_.emplace(PLC_INSTANCE,
                     std::vector<std::string>{"--name", "line1", "--pool", host.pool_name(),
                                              "--run-directory", host.run_directory(), "--log-level",
                                              "warning", "--core", fmt::format("{}", fmt::join(cores, ",")),
                                              "--application", COUNTED_RUNS_APPLICATION});
    const TimePoint end = soon();
    while (!is_up() && MonotonicClock::now() < end) ::usleep(1000);
    host_.write_instance(0, "line1", InstanceState::running, process_->pid());
    host_.write_count(1);
  }
  ~CountingInstance() {
    process_->signal(SIGTERM);
    EXPECT_EQ(process_->wait(), 0);
  }
  CountingInstance(const CountingInstance&) = delete;
  CountingInstance& operator=(const CountingInstance&) = delete;

  [[nodiscard]] bool is_up() const {
    const auto page = InstancePageReader::open(host_.pool_name(), "line1");
    const auto runtime = page ? page->runtime() : std::nullopt;
    return runtime && runtime->state == ApplicationState::running;
  }
  void ask(ControlVerb verb, const std::string& argument = {}) {
    auto link = PacketSocket::connect(instance_socket_path(host_.run_directory(), "line1")).value();
    ASSERT_TRUE(link.send(
        encode(ControlRequest{.number = 1, .verb = verb, .instance = "line1", .argument = argument})));
    const auto packet = receive_until(link, soon());
    ASSERT_TRUE(packet) << packet.error().describe();
    const auto reply = decode_reply(*packet);
    ASSERT_TRUE(reply);
    EXPECT_EQ(reply->code, ErrorCode::ok) << reply->text;
  }
  [[nodiscard]] std::uint64_t runs(std::size_t event) const { return runs_[event].load(); }
  [[nodiscard]] TaskCounters counters(std::size_t event) const {
    const auto page = InstancePageReader::open(host_.pool_name(), "line1");
    for (std::uint32_t i = 0; page && i < page->task_count(); ++i) {
      const auto task = page->task(i);
      if (task && task->identity.name.view() == "Count" + std::to_string(event)) return task->counters;
    }
    return {};
  }
  [[nodiscard]] PoolEvent event(std::size_t number) const {
    return pool_.create_event(event_object_name("line1", "e" + std::to_string(number))).value();
  }

 private:
  TestHost& host_;
  std::string file_;
  const std::atomic<std::uint64_t>* runs_ = nullptr;
  mutable ObjectPool pool_ = ObjectPool::create(host_.pool_name()).value();
  std::optional<Child> process_;
};

/// Stops, starts and switches it at moments of which nobody knows; at the end it runs.
class Disturbance {
 public:
  Disturbance(CountingInstance& instance, std::uint32_t seed) : instance_(instance), random_(seed) {}

  void next() {
    switch (number_++ % 4) {
      case 0:
        return instance_.ask(ControlVerb::stop);
      case 1:
        return instance_.ask(ControlVerb::start);
      case 2:
        return instance_.ask(ControlVerb::set_scheduler, "CmpScheduleTimer");
      default:
        return instance_.ask(ControlVerb::set_scheduler, "CmpSchedule");
    }
  }
  void pause(microseconds most) {
    std::this_thread::sleep_for(
        microseconds(std::uniform_int_distribution<std::int64_t>(0, most.count())(random_)));
  }
  [[nodiscard]] bool stops_next() const { return number_ % 4 == 0; }

 private:
  CountingInstance& instance_;
  std::mt19937 random_;
  unsigned number_ = 0;
};

// On one core the tasks interrupt the poster between its posts.
class PostsAroundStops : public testing::TestWithParam<bool> {
 protected:
  [[nodiscard]] static std::vector<int> cores() {
    const auto all = allowed_cores(0).value();
    return GetParam() ? std::vector{all.back()} : all;
  }
};

INSTANTIATE_TEST_SUITE_P(On, PostsAroundStops, testing::Bool(),
                         [](const auto& test) { return test.param ? "OneCore" : "AllCores"; });

// One post to each event in each round.
TEST_P(PostsAroundStops, OfThePoolAreToldWhatHappensToThem) {
  const OwnDomain domain;
  TestHost host(domain, "hosta", 256);
  CountingInstance sut(host, cores());
  std::vector<PoolEvent> events;
  for (std::size_t i = 0; i < CountingInstance::kEvents; ++i) events.push_back(sut.event(i));
  const auto seed = std::random_device()();
  SCOPED_TRACE("seed " + std::to_string(seed));
  Disturbance disturbance(sut, seed);
  std::size_t told_no_task = 0;
  std::size_t told_posted = 0;
  std::array<std::uint64_t, CountingInstance::kEvents> expected{};  // runs
  std::array<std::uint64_t, CountingInstance::kEvents> posts{};
  for (int round = 0; round < 200 && !HasFailure(); ++round) {
    const bool stops = disturbance.stops_next();
    std::array<PostResult, CountingInstance::kEvents> told{};
    std::jthread poster([&, pause = std::mt19937(seed + static_cast<std::uint32_t>(round))]() mutable {
      bind_this_thread(cores());
      for (std::size_t i = 0; i < events.size(); ++i) {
        told[i] = events[i].post();
        const TimePoint until =
            MonotonicClock::now() + microseconds(std::uniform_int_distribution<int>(0, 60)(pause));
        while (MonotonicClock::now() < until) continue;
      }
    });
    disturbance.pause(microseconds(1200));
    disturbance.next();
    poster.join();
    for (std::size_t i = 0; i < events.size(); ++i) {
      ++posts[i];
      ++(told[i] == PostResult::posted ? told_posted : told_no_task);
      ASSERT_NE(told[i], PostResult::not_registered);
      const auto done = [&] {
        const TaskCounters counters = sut.counters(i);
        return counters.cycles + counters.lost_events == posts[i];
      };
      const TimePoint end = soon();
      while (!done() && MonotonicClock::now() < end) ::usleep(200);
      EXPECT_TRUE(done()) << "each post is run or lost";
      // Of those that a task had taken, a stop may lose the ones for which no cycle has begun.
      const bool may_be_lost = told[i] == PostResult::posted && stops;
      if (may_be_lost && sut.runs(i) == expected[i]) continue;
      if (told[i] == PostResult::posted) ++expected[i];
      EXPECT_EQ(sut.runs(i), expected[i]) << "event " << i << " in round " << round << ", told "
                                          << (told[i] == PostResult::posted ? "posted" : "no task");
    }
  }
  EXPECT_GT(told_no_task, 100U);
  EXPECT_GT(told_posted, 100U);
}

// One post after the other to an event of its own, each compared with what its task has done by then.
struct Poster {
  std::unique_ptr<ControlClient> client;
  std::size_t event = 0;
  std::atomic<std::size_t> run{0};
  std::atomic<std::size_t> not_run{0};

  void post(const CountingInstance& sut) {
    const std::uint64_t before = sut.runs(event);
    const auto told = client->post_and_await({"hosta", "line1", "e" + std::to_string(event)}, kPatience);
    const std::uint64_t after = sut.runs(event);
    if (told) {
      ++run;
      EXPECT_EQ(after, before + 1) << "told as run, by " << told->last_task;
      return;
    }
    ++not_run;
    EXPECT_THAT(told.error().code, testing::AnyOf(ErrorCode::not_found, ErrorCode::wrong_state))
        << told.error().message;
    EXPECT_EQ(after, before) << told.error().message;
    not_run_at = after;
  }
  std::optional<std::uint64_t> not_run_at;  // the last one, which must not be run later, either
};

TEST_P(PostsAroundStops, OverDdsAreToldAsRunIfAndOnlyIfTheyRun) {
  const OwnDomain domain;
  TestHost host(domain, "hosta", 256);
  CountingInstance sut(host, cores());
  host.start_server();
  std::vector<Poster> posters(3);
  for (std::size_t i = 0; i < posters.size(); ++i) {
    posters[i].client = connect(domain);
    posters[i].event = i;
    // The server follows the instance.
    const TimePoint end = soon();
    while (!posters[i].client->post_and_await({"hosta", "line1", "e" + std::to_string(i)}, kPatience) &&
           MonotonicClock::now() < end) {
      ::usleep(10'000);
    }
  }
  const auto seed = std::random_device()();
  SCOPED_TRACE("seed " + std::to_string(seed));
  Disturbance disturbance(sut, seed);
  std::atomic<bool> enough{false};
  std::vector<std::jthread> threads;
  for (Poster& poster : posters) {
    threads.emplace_back([&] {
      while (!enough && !testing::Test::HasFailure()) {
        poster.post(sut);
        ::usleep(100);  // a post that was told as lost would be run now
        if (poster.not_run_at) {
          EXPECT_EQ(sut.runs(poster.event), *poster.not_run_at) << "told as not run, and run later";
        }
        poster.not_run_at.reset();
      }
    });
  }
  const auto have_enough = [&] {
    return std::ranges::all_of(posters, [](const Poster& one) { return one.run > 20 && one.not_run > 5; });
  };
  for (int round = 0; (round < 400 || !have_enough()) && !testing::Test::HasFailure(); ++round) {
    disturbance.next();
    disturbance.pause(microseconds(6000));
  }
  enough = true;
  threads.clear();
}

}  // namespace
}  // namespace plchost
