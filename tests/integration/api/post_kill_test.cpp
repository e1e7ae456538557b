// Posters whose plchost-dds is killed.

#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <thread>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <pthread.h>
#include <signal.h>

#include "api/client/control_client.hpp"
#include "tests/integration/api/test_host.hpp"
#include "tests/support/one_core.hpp"

namespace plchost {
namespace {

using std::chrono::milliseconds;

const HostEvent kReady{"hosta", "line1", "ready"};

/// A figure of a test, or what the environment says, for a longer run by hand.
std::uint64_t figure(const char* variable, std::uint64_t usual) {
  const char* const given = std::getenv(variable);
  return given == nullptr ? usual : std::strtoull(given, nullptr, 10);
}

/// A task at FIFO on the server's core. It is released by the server's wake within the post, so that nothing
/// of the server runs between. At so many of its runs it kills the server right there.
class KillingTask {
 public:
  KillingTask(CountedEvent& event, std::uint64_t posts, std::uint64_t kills)
      : event_(event), every_(posts / (kills + 1)), kills_(kills), thread_([this] { work(); }) {
    const sched_param high{.sched_priority = 40};
    (void)::pthread_setschedparam(thread_.native_handle(), SCHED_FIFO, &high);
  }
  KillingTask(const KillingTask&) = delete;
  KillingTask& operator=(const KillingTask&) = delete;
  ~KillingTask() { stop(); }

  void stop() {
    ended_.store(true);
    event_.nudge();
    if (thread_.joinable()) thread_.join();
  }
  /// The server to kill next; 0: it is killed.
  std::atomic<pid_t> server{0};
  [[nodiscard]] std::uint64_t runs() const { return runs_.load(); }
  [[nodiscard]] std::uint64_t killed() const { return killed_.load(); }
  [[nodiscard]] bool has_killed_all() const { return killed_.load() == kills_; }

 private:
  void work() {
    for (;;) {
      const auto seen = event_.snapshot();
      while (runs_.load() < seen.count()) run();
      if (ended_.load()) return;
      event_.wait(seen);
    }
  }
  void run() {
    const std::uint64_t run = runs_.fetch_add(1) + 1;
    if (has_killed_all() || run < (killed_.load() + 1) * every_) return;
    const pid_t pid = server.exchange(0);
    if (pid == 0) return;  // the next run does it
    ::kill(pid, SIGKILL);
    killed_.fetch_add(1);
  }

  CountedEvent& event_;
  const std::uint64_t every_;
  const std::uint64_t kills_;
  std::atomic<std::uint64_t> runs_{0};
  std::atomic<std::uint64_t> killed_{0};
  std::atomic<bool> ended_{false};
  std::thread thread_;
};

TEST(PostsAtAKill, AreRunAsOftenAsTheyAreAcknowledged) {
  constexpr std::uint64_t kClients = 20;
  const std::uint64_t posts = figure("PLCHOST_KILL_POSTS", 10'000);
  const std::uint64_t kills = figure("PLCHOST_KILLS", 6);
  const OwnDomain domain;
  TestHost host(domain, "hosta");
  const PoolEvent event = host.add_event("line1", "ready");
  event.set_bound_tasks(1);
  std::atomic<bool> ended{false};
  std::unique_ptr<KillingTask> task;
  std::thread replacer([&] {
    const OneCore core;  // the server's and the task's
    host.start_server();
    task = std::make_unique<KillingTask>(event.counted(), posts, kills);
    std::uint64_t replaced = 0;
    for (task->server.store(host.server().pid()); !ended.load();) {
      std::this_thread::sleep_for(milliseconds(1));
      if (task->killed() == replaced) continue;
      ++replaced;
      host.replace_server();
      task->server.store(host.server().pid());
    }
  });
  std::atomic<std::uint64_t> accepted{0};
  std::atomic<std::uint64_t> rest{0};
  {
    std::vector<std::jthread> clients;
    for (std::uint64_t i = 0; i < kClients; ++i) {
      clients.emplace_back([&] {
        const auto client = connect(domain);
        const auto report = client->post_event(kReady, posts / kClients, Duration::zero(), 5 * kPatience);
        if (!report) return;
        accepted += report->accepted;
        rest += report->unacknowledged + report->rejected + report->lost;
      });
    }
  }
  ended.store(true);
  replacer.join();
  while (task->runs() < event.counted().count()) std::this_thread::sleep_for(milliseconds(1));
  fmt::print("{} kills, {} posts acknowledged, {} runs\n", task->killed(), accepted.load(), task->runs());
  task->stop();

  EXPECT_TRUE(task->has_killed_all());
  EXPECT_EQ(rest.load(), 0U);
  EXPECT_EQ(accepted.load(), posts);
  EXPECT_EQ(task->runs(), accepted.load());
}

}  // namespace
}  // namespace plchost
