#include <chrono>
#include <cstring>
#include <random>
#include <set>
#include <thread>

#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include "tests/unit/block_driver/node_fixture.hpp"

// Processes that are killed at any instruction. After each kill those that live must go on as if nothing had
// been.

namespace plchost {
namespace {

constexpr int kKills = 100;

class BlockCrash : public BlockNodes {
 protected:
  [[nodiscard]] NodeOptions quick(const std::string& name) const {
    NodeOptions chosen = options(name);
    chosen.hold = std::chrono::milliseconds(200);
    return chosen;
  }
  /// Runs `body` in a process that never ends by itself.
  template <class Body>
  static pid_t in_child(Body body) {
    const pid_t child = ::fork();
    if (child != 0) return child;
    body();
    ::_exit(1);
  }
  void kill_soon(pid_t child) {
    std::this_thread::sleep_for(std::chrono::microseconds(random_() % 6000));
    kill_now(child);
  }
  static void kill_now(pid_t child) {
    ::kill(child, SIGKILL);
    int status = 0;
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    ASSERT_TRUE(WIFSIGNALED(status)) << "it failed before it was killed: " << WEXITSTATUS(status);
  }
  /// Serves until `done`; false: it never comes.
  template <class Done>
  bool serve_until(TestNode& node, Done done) {
    const TimePoint end = MonotonicClock::now() + std::chrono::seconds(20);
    while (MonotonicClock::now() < end) {
      node.router->serve(MonotonicClock::now());
      if (done()) return true;
      std::this_thread::sleep_for(std::chrono::microseconds(100));
    }
    return false;
  }
  /// Contents that tell by themselves whether they are whole.
  static std::vector<std::byte> numbered(std::uint32_t number) {
    std::vector<std::byte> contents(8 + number * 37 % 3000);
    for (std::size_t i = 0; i < contents.size(); ++i) contents[i] = static_cast<std::byte>(number + i);
    std::memcpy(contents.data(), &number, sizeof number);
    return contents;
  }
  static std::uint32_t number_of(std::span<const std::byte> contents) {
    std::uint32_t number = 0;
    if (contents.size() >= sizeof number) std::memcpy(&number, contents.data(), sizeof number);
    EXPECT_EQ(std::vector(contents.begin(), contents.end()), numbered(number));
    return number;
  }

  std::minstd_rand random_{4711};
};

TEST_F(BlockCrash, WhoIsKilledWhileItJoinsOrLeavesLeavesTheDirectoryWhole) {
  NodeDirectory sut = NodeDirectory::open(pool()).value();
  for (int i = 0; i < kKills; ++i) {
    const pid_t child = in_child([&] {
      for (;;) {
        NodeDirectory directory = NodeDirectory::open(pool()).value();
        std::vector<NodeLife> lives;
        for (const char* name : {"a", "b", "c"}) lives.push_back(directory.join({.name = name}).value());
        for (const NodeLife& life : lives) directory.leave(life);
      }
    });
    kill_soon(child);
    // All three names can be had at once, each with an address of its own.
    std::set<std::uint16_t> addresses;
    std::vector<NodeLife> lives;
    for (const char* name : {"a", "b", "c"}) {
      const auto life = sut.join({.name = name});
      ASSERT_TRUE(life) << life.error().describe();
      EXPECT_TRUE(addresses.insert(life->node).second);
      lives.push_back(*life);
    }
    for (const NodeLife& life : lives) sut.leave(life);
    for (std::uint16_t node = 1; node <= kMaxNodes; ++node) ASSERT_FALSE(sut.record(node));
  }
}

TEST_F(BlockCrash, ASenderThatIsKilledAtAnyMomentLeavesItsReceiverUnharmed) {
  TestNode sut = join(quick("receiver"));
  BlockChannel channel = sut.channel();
  std::uint32_t received = 0;
  for (int i = 0; i < kKills; ++i) {
    const pid_t child = in_child([&] {
      TestNode sender = join(quick("sender"));
      BlockChannel out = sender.channel();
      for (std::uint32_t number = 0;;) {
        sender.router->serve(MonotonicClock::now());
        while (out.send(sut.address(), numbered(number), static_cast<BlockPriority>(number % 4)) ==
               SendResult::sent) {
          ++number;
        }
      }
    });
    // Of each priority the numbers come in their order, each whole; none of the life before.
    std::array<std::int64_t, kBlockPriorities> last{-1, -1, -1, -1};
    const auto take_all = [&] {
      // Not for ever: a sender may be faster than its receiver.
      for (int left = 300; left > 0 && channel.receive(sut.buffer, sut.received) == TakeResult::taken;
           --left) {
        const std::uint32_t number = number_of(std::span(sut.buffer).first(sut.received.size));
        auto& before = last.at(number % 4);
        EXPECT_EQ(number, before < 0 ? number % 4 : before + 4);
        before = number;
        ++received;
      }
      return last[0] >= 0;
    };
    ASSERT_TRUE(serve_until(sut, take_all)) << "after " << i << " kills nothing came any more";
    kill_soon(child);
    take_all();
    const auto gone = [&] {
      take_all();
      return channel.send({.host = 0, .node = sut.received.from.node}, {}) == SendResult::unreachable;
    };
    ASSERT_TRUE(serve_until(sut, gone)) << "its death was not seen";
    if (HasFailure()) return;
  }
  EXPECT_GT(received, static_cast<std::uint32_t>(kKills));
}

TEST_F(BlockCrash, AReceiverThatIsKilledAtAnyMomentLeavesItsSenderUnharmed) {
  TestNode sut = join(quick("sender"));
  BlockChannel channel = sut.channel();
  NodeAddress to;
  std::uint32_t number = 0;
  for (int i = 0; i < kKills; ++i) {
    const pid_t child = in_child([&] {
      TestNode receiver = join(quick("receiver"));
      BlockChannel in = receiver.channel();
      for (;;) {
        receiver.router->serve(MonotonicClock::now());
        while (in.receive(receiver.buffer, receiver.received) == TakeResult::taken) {
          (void)number_of(std::span(receiver.buffer).first(receiver.received.size));
        }
        if (HasFailure()) ::_exit(2);
      }
    });
    // It comes up under the address that it had, and takes more than its queue holds.
    std::uint32_t sent = 0;
    const auto send_some = [&] {
      const NodeAddress found = sut.node->find("receiver");
      if (found == NodeAddress{}) return false;
      EXPECT_TRUE(to == NodeAddress{} || to == found);
      to = found;
      while (channel.send(to, numbered(number)) == SendResult::sent) {
        ++number;
        ++sent;
      }
      return sent > kMinRingSlots;
    };
    ASSERT_TRUE(serve_until(sut, send_some)) << "after " << i << " kills nothing could be sent any more";
    kill_soon(child);
    const auto gone = [&] { return channel.send(to, numbered(number)) == SendResult::unreachable; };
    ASSERT_TRUE(serve_until(sut, gone)) << "its death was not seen";
    if (HasFailure()) return;
  }
}

}  // namespace
}  // namespace plchost
