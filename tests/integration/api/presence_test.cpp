#include <fstream>
#include <functional>
#include <thread>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <sys/ptrace.h>
#include <sys/syscall.h>
#include <sys/wait.h>

#include "api/client/control_client.hpp"
#include "tests/integration/api/test_host.hpp"

namespace plchost {
namespace {

using std::chrono::milliseconds;

// A client is promised to know of a dead server within 100 ms. A shared machine may stand still for longer.
constexpr Duration kKnownWithin = 20 * milliseconds(100);

/// One thread of a child process, standing still while this object lives; the other threads of it run on.
/// It is stopped while it waits for news. Elsewhere it could hold a lock that the others need.
class StoppedThread {
 public:
  explicit StoppedThread(pid_t thread) : thread_(thread) {
    if (::ptrace(PTRACE_SEIZE, thread_, nullptr, nullptr) != 0) return;
    constexpr int kMost = 5'000;
    for (int i = 0; i < kMost && interrupt() && !(stopped_ = waits_for_news()); ++i) {
      ::ptrace(PTRACE_CONT, thread_, nullptr, nullptr);
      std::this_thread::sleep_for(milliseconds(1));
    }
  }
  StoppedThread(const StoppedThread&) = delete;
  StoppedThread& operator=(const StoppedThread&) = delete;
  ~StoppedThread() { ::ptrace(PTRACE_DETACH, thread_, nullptr, nullptr); }
  [[nodiscard]] bool stopped() const { return stopped_; }

 private:
  bool interrupt() {
    return ::ptrace(PTRACE_INTERRUPT, thread_, nullptr, nullptr) == 0 &&
           ::waitpid(thread_, nullptr, __WALL) == thread_;
  }
  [[nodiscard]] bool waits_for_news() const {
    std::ifstream call(fmt::format("/proc/{}/syscall", thread_));
    long number = -1;
    call >> number;
#ifdef SYS_epoll_wait  // not on each architecture
    if (number == SYS_epoll_wait) return true;
#endif
    return number == SYS_epoll_pwait;
  }

  pid_t thread_;
  bool stopped_ = false;
};

class Presence : public testing::Test {
 protected:
  Presence() {
    event_ = host_.add_event("line1", "ready");
    host_.start_server();
    sut_ = connect(domain_);
    EXPECT_TRUE(sut_->host("hosta", soon()));
    EXPECT_TRUE(sut_->prepare_posts("hosta", soon()));
    until([this] { return !sut_->is_silent("hosta"); });
  }

  void until(const std::function<bool()>& happened) {
    const TimePoint end = soon();
    while (!happened() && MonotonicClock::now() < end) sut_->wait_for_change(end);
    ASSERT_TRUE(happened());
  }
  /// Waits until the client knows, and checks how long that took.
  void expect_silence(const std::string& why) {
    const TimePoint start = MonotonicClock::now();
    until([this] { return sut_->is_silent("hosta"); });
    const Duration took = MonotonicClock::now() - start;
    fmt::print("{}: known after {:.1f} ms\n", why, std::chrono::duration<double, std::milli>(took).count());
    EXPECT_LT(took, kKnownWithin);
  }

  OwnDomain domain_;
  TestHost host_{domain_, "hosta"};
  PoolEvent event_;
  std::unique_ptr<ControlClient> sut_;
};

TEST_F(Presence, ThatComesAgainIsAChangeAlsoIfItsSilenceWasNotCountedAsOne) {
  until([this] { return sut_->changes() > 0; });
  host_.server().signal(SIGSTOP);
  const std::uint64_t before = sut_->changes();
  until([this] { return sut_->is_silent("hosta"); });
  host_.server().signal(SIGCONT);
  until([this] { return !sut_->is_silent("hosta"); });
  EXPECT_GT(sut_->changes(), before) << "a watch that told the silence looks again";
}

TEST_F(Presence, OfAKilledServerEnds) {
  host_.server().signal(SIGKILL);
  expect_silence("killed");
}

TEST_F(Presence, OfAStoppedServerEndsAndComesBack) {
  host_.server().signal(SIGSTOP);
  expect_silence("stopped");

  host_.server().signal(SIGCONT);
  until([this] { return !sut_->is_silent("hosta"); });
}

// A server that only DDS's own threads keep up looks alive to leases and to automatic liveliness.
TEST_F(Presence, OfAServerWhoseLoopHangsEndsAlthoughDdsGoesOn) {
  {
    const StoppedThread loop(host_.server().pid());
    ASSERT_TRUE(loop.stopped());
    expect_silence("loop hangs");

    const std::uint64_t before = event_.counted().count();
    while (event_.counted().count() ==
           before) {  // again: a host that is not seen for long is dropped, and met anew
      ASSERT_TRUE(sut_->post_one("hosta", "line1", "ready"));
      std::this_thread::sleep_for(milliseconds(1));
    }
    // The last presence from before may have come late.
    until([this] { return sut_->is_silent("hosta"); });
  }
  until([this] { return !sut_->is_silent("hosta"); });
}

TEST_F(Presence, OfAHostThatWasNeverSeenIsNotMissed) {
  EXPECT_FALSE(sut_->is_silent("hostb"));
}

}  // namespace
}  // namespace plchost
