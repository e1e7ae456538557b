// An API server that is killed at each instruction of a post in turn, by a debugger, while others post.

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdlib>
#include <limits>
#include <set>
#include <string>
#include <thread>
#include <utility>

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/ptrace.h>
#include <sys/wait.h>
#include <unistd.h>

#include "api/dds/text.hpp"
#include "api/server/posts/event_intake.hpp"
#include "tests/support/one_core.hpp"
#include "tests/support/own_name.hpp"
#include "tests/support/sanitized.hpp"
#include "tests/support/stepped_child.hpp"

namespace plchost {
namespace {

/// As a task does it: sleeps on the event, and counts what it was woken for.
class Follower {
 public:
  explicit Follower(CountedEvent& event) : event_(event), thread_([this] { follow(); }) {}
  Follower(const Follower&) = delete;
  Follower& operator=(const Follower&) = delete;
  ~Follower() {
    stop_.store(true);
    event_.nudge();
    thread_.join();
  }
  /// Whether it has seen that many posts within 10 s.
  [[nodiscard]] bool reaches(std::uint64_t count) const {
    for (int i = 0; i < 100'000 && seen_.load() < count; ++i) ::usleep(100);
    return seen_.load() == count;
  }

 private:
  void follow() {
    while (!stop_.load()) {
      const auto snapshot = event_.snapshot();
      seen_.store(snapshot.count());
      if (!stop_.load()) event_.wait(snapshot);
    }
  }
  CountedEvent& event_;
  std::atomic<bool> stop_{false};
  std::atomic<std::uint64_t> seen_{0};
  std::thread thread_;
};

/// From one kill to the next, in instructions: 1 for all of them, which takes minutes.
int stride(int usual) {
  const char* const wanted = std::getenv("PLCHOST_KILL_STRIDE");
  return wanted != nullptr ? std::max(1, std::atoi(wanted)) : usual;
}

class EachInstructionOfAPost : public testing::Test {
 protected:
  static constexpr std::size_t kAll = std::numeric_limits<std::size_t>::max();

  void SetUp() override {
    if (kSanitized) GTEST_SKIP() << "too many instructions";
  }
  EachInstructionOfAPost() {
    for (PoolEvent* const event : {&event_, &other_}) {
      event->set_registered(true);
      event->set_bound_tasks(1);
    }
    dds::copy_text(post_.host, "hosta");
    dds::copy_text(post_.instance, "line1");
    dds::copy_text(post_.event, "ready");
    post_.source[0] = 1;
    batch_.source[0] = 2;
    dds::copy_text(batch_.host, "hosta");
    for (std::size_t i = 0; i < names_.size(); ++i) {
      dds::copy_text(names_[i].instance, "line1");
      dds::copy_text(names_[i].event, i == 1 ? "other" : "ready");
    }
    batch_.events = {._maximum = 3, ._length = 3, ._buffer = names_.data(), ._release = false};
    other_batch_ = batch_;
    other_batch_.source[0] = 3;
  }
  ~EachInstructionOfAPost() override {
    MemoryFile::remove(PostLedger::file_name(name_));
    ObjectPool::remove(name_);
  }

  [[nodiscard]] EventIntake make() const {
    return {"hosta", pool_, PostLedger::open(pool_).value(), 7, guard_};
  }
  /// A server that does the post, `call`, and is killed after so many instructions of it. Before that, and
  /// when it has done half of them, `beside` is called.
  template <class Call, class Beside>
  void kill_within(Call call, std::size_t instructions, Beside beside) {
    other_batch_.sequence_number = other_batch_.base_sequence = ++other_batches_;
    kill_child_within(
        [&](const auto& begin) {
          const ObjectPool pool = ObjectPool::attach(name_).value();
          EventIntake server{"hosta", pool, PostLedger::open(pool).value(), 7, guard_};
          server.process(other_batch_);  // the work that a server does only once is not counted
          begin();
          call(server);
        },
        instructions, beside);
  }
  /// The same with a child that does `work(begin)`: the instructions count from when it calls begin().
  template <class Work, class Beside>
  void kill_child_within(Work work, std::size_t instructions, Beside beside) {
    const pid_t forked = ::fork();
    if (forked == 0) {
      work([] {
        ::ptrace(PTRACE_TRACEME, 0, nullptr, nullptr);
        ::raise(SIGSTOP);
      });
      ::raise(SIGSTOP);
      ::_exit(0);
    }
    SteppedChild child(forked);
    if (instructions == kAll) {
      trace_ = child.run_to_end();
      return beside();
    }
    bool within = child.go(trace_, 0, instructions / 2);
    beside();
    within = within && child.go(trace_, instructions / 2, instructions);
    beside();
    kills_ += within ? 1 : 0;
  }
  /// Calls `round(instructions)` for each `stride`-th instruction after which the child is to be killed. The
  /// rounds before that are for what only the first post does, and for the trace of another one. Two have the
  /// same trace: on a busy machine a single one can go a way that no other goes.
  template <class Round>
  void kill_at_each(int stride, Round round) {
    ASSERT_NO_FATAL_FAILURE(round(kAll));
    constexpr int kMost = 50;
    std::set<SteppedChild::Trace> ways{std::exchange(trace_, {})};
    for (int i = 0; i < kMost; ++i) {
      ASSERT_NO_FATAL_FAILURE(round(kAll));
      if (!ways.insert(trace_).second) break;
      ASSERT_LT(i, kMost - 1) << "no two posts went the same way";
    }
    ASSERT_GT(trace_.size(), 50U);
    std::size_t rounds = 0;
    for (std::size_t i = 0; i < trace_.size(); i += static_cast<std::size_t>(stride), ++rounds) {
      ASSERT_NO_FATAL_FAILURE(round(i));
    }
    // Others go another way than the trace, as by a task that does not sleep yet.
    EXPECT_GE(kills_, rounds / 2) << "of " << rounds;
  }
  /// The fate of the posts of a source, seen by the present server.
  static EventIntake::Writer writer_of(const EventIntake& server, std::uint8_t source) {
    for (const EventIntake::Writer& writer : server.writers()) {
      if (writer.source.bytes[0] == source) return writer;
    }
    return {};
  }
  static std::string shown(std::size_t instructions) {
    return instructions == kAll ? "all instructions" : std::to_string(instructions) + " instructions";
  }
  static void expect_sum(const PostCounters& counters, const std::string& where) {
    EXPECT_EQ(counters.received, counters.accepted + counters.duplicate) << where;
    EXPECT_EQ(counters.rejected + counters.early + counters.lost + counters.malformed, 0U) << where;
  }

  OneCore core_;  // each step is a change from one process to the other
  std::string name_ = own_name("post-step");
  ObjectPool pool_ = ObjectPool::create(name_, {.max_objects = 16}).value();
  AccessGuard guard_;
  PoolEvent event_ = pool_.create_event("line1/ready").value();
  PoolEvent other_ = pool_.create_event("line1/other").value();
  plc_EventPost post_{};
  plc_EventBatch batch_{};
  plc_EventBatch other_batch_{};
  std::uint64_t other_batches_ = 0;  // each posts "ready" twice and "other" once
  std::array<plc_EventName, 3> names_{};
  SteppedChild::Trace trace_;
  std::size_t kills_ = 0;
};

TEST_F(EachInstructionOfAPost, OfTheLedgerCountsItOnceWhileOthersPostToo) {
  std::uint64_t others = 0;
  std::uint64_t number = 0;
  const auto beside = [&] {
    event_.post();
    ++others;
  };
  const auto post_next = [](PostLedger& ledger, LedgerEntry& entry, const PoolEvent& event) {
    SourceState after = entry.state();
    ++after.last;
    ++after.counters.accepted;
    return ledger.post(entry, event, PostLedger::Allowed::registered,
                       [&](const CountedEvent::Snapshot& /*seen*/) { return after; });
  };
  dds::Guid source;
  source.bytes[0] = 1;
  kill_at_each(1, [&](std::size_t instructions) {
    ++number;
    kill_child_within(
        [&](const auto& begin) {
          ObjectPool pool = ObjectPool::attach(name_).value();
          const PoolEvent event = pool.open_event("line1/ready").value();
          PostLedger ledger = PostLedger::open(pool).value();
          LedgerEntry& entry = ledger.entry_for(source, 1);
          begin();
          (void)post_next(ledger, entry, event);
        },
        instructions, beside);
    PostLedger next = PostLedger::open(pool_).value();
    LedgerEntry& entry = next.entry_for(source, 1);
    const std::string where = shown(instructions);
    if (entry.state().last != number) {
      ASSERT_TRUE(post_next(next, entry, event_)) << where;
    }
    ASSERT_EQ(event_.counted().count(), number + others) << where;
    ASSERT_EQ(entry.state().last, number) << where;
    ASSERT_EQ(entry.state().counters.accepted, number) << where;
  });
}

TEST_F(EachInstructionOfAPost, CountsItOnceWhereverTheServerIsKilled) {
  std::uint64_t others = 0;
  std::uint64_t number = 0;
  const auto beside = [&] {
    event_.post();
    ++others;
  };
  const auto call = [&](EventIntake& server) { server.process(post_); };
  kill_at_each(stride(23), [&](std::size_t instructions) {
    post_.sequence_number = post_.base_sequence = ++number;
    kill_within(call, instructions, beside);
    EventIntake next = make();
    next.process(post_);  // nothing was acknowledged
    const std::string where = shown(instructions);
    ASSERT_EQ(event_.counted().count(), number + others + 2 * other_batches_) << where;
    const EventIntake::Writer writer = writer_of(next, 1);
    ASSERT_EQ(writer.last, number) << where;
    ASSERT_EQ(writer.counters.accepted, number) << where;
    expect_sum(writer.counters, where);
  });
}

TEST_F(EachInstructionOfAPost, LeavesNoTaskAsleep) {
  std::uint64_t number = 0;
  const auto call = [&](EventIntake& server) { server.process(post_); };
  kill_at_each(stride(41), [&](std::size_t instructions) {
    const Follower task(event_.counted());
    post_.sequence_number = post_.base_sequence = ++number;
    kill_within(call, instructions, [] {});
    EventIntake next = make();
    next.process(post_);
    ASSERT_TRUE(task.reaches(number + 2 * other_batches_)) << shown(instructions);
  });
}

TEST_F(EachInstructionOfAPost, OfABatchPostsEachEventOnce) {
  std::uint64_t number = 0;
  std::uint64_t others = 0;
  const auto beside = [&] {
    event_.post();
    ++others;
  };
  const auto call = [&](EventIntake& server) { server.process(batch_); };
  kill_at_each(stride(53), [&](std::size_t instructions) {
    batch_.sequence_number = batch_.base_sequence = ++number;
    kill_within(call, instructions, beside);
    EventIntake next = make();
    next.process(batch_);
    const std::string where = shown(instructions);
    ASSERT_EQ(event_.counted().count(), 2 * (number + other_batches_) + others) << where;
    ASSERT_EQ(other_.counted().count(), number + other_batches_) << where;
    const EventIntake::Writer writer = writer_of(next, 2);
    ASSERT_EQ(writer.counters.accepted, number) << where;
    expect_sum(writer.counters, where);
  });
}

}  // namespace
}  // namespace plchost
