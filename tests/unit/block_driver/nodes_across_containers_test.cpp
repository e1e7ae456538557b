// Nodes in several PID namespaces. Whether the process of one runs is told by its lock alone.

#include <atomic>
#include <chrono>
#include <csignal>
#include <string>
#include <thread>

#include <fcntl.h>
#include <gmock/gmock.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include "shm/block_driver/node_locks.hpp"
#include "shm/files/pool_files.hpp"
#include "tests/support/another_namespace.hpp"
#include "tests/unit/block_driver/node_fixture.hpp"

namespace plchost {
namespace {

using std::chrono::milliseconds;
using testing::HasSubstr;

class NodesAcrossContainers : public BlockNodes {
 protected:
  NodesAcrossContainers()
      : step_(*new(::mmap(nullptr, sizeof(std::atomic<int>), PROT_READ | PROT_WRITE,
                          MAP_SHARED | MAP_ANONYMOUS, -1, 0)) std::atomic<int>{0}),
        sut_(NodeDirectory::open(pool()).value()) {}
  ~NodesAcrossContainers() override { ::munmap(&step_, sizeof(std::atomic<int>)); }
  void SetUp() override {
    const InAnotherNamespace probe([] { return 0; });
    if (!probe.permitted()) GTEST_SKIP() << "a PID namespace needs root";
  }
  /// A process in a namespace of its own that joins and then waits. Each is process 1 there.
  [[nodiscard]] InAnotherNamespace join_inside(const std::string& name, std::uint16_t forced = 0) {
    step_ = 0;
    InAnotherNamespace process([&] {
      auto directory = NodeDirectory::open(pool());
      step_ = directory && directory->join({.name = name, .forced_address = forced}) ? 1 : 2;
      for (;;) ::pause();
      return 0;
    });
    while (step_ == 0) std::this_thread::sleep_for(milliseconds(1));
    EXPECT_EQ(step_, 1);
    return process;
  }

  std::atomic<int>& step_;
  NodeDirectory sut_;
};

TEST_F(NodesAcrossContainers, NodeInsideRunsUntilItsProcessIsKilled) {
  auto other = join_inside("a", 5);
  EXPECT_EQ(sut_.reclaim(), 0U);
  const auto refused = sut_.join({.name = "b", .forced_address = 5});
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("process " + std::to_string(other.pid()) + ", has it"));
  other.kill();
  EXPECT_EQ(sut_.reclaim(), 1U);
  EXPECT_TRUE(sut_.join({.name = "b", .forced_address = 5}));
}

TEST_F(NodesAcrossContainers, NodeOutsideRunsForOneInsideThoughItsNumberIsNothingThere) {
  const NodeLife life = sut_.join({.name = "a"}).value();
  EXPECT_EQ(InAnotherNamespace([&] {
              auto directory = NodeDirectory::open(pool());
              if (!directory || directory->reclaim() != 0) return 1;
              if (directory->owner_text(life.node) != "a process of another container") return 2;
              return directory->join({.name = "a"}) ? 3 : 0;
            }).wait(),
            0);
  EXPECT_TRUE(sut_.record(life.node));
}

TEST_F(NodesAcrossContainers, ProcessesOfTheSameNumberHaveANodeEach) {
  auto first = join_inside("first", 5);
  auto second = join_inside("second", 6);
  first.kill();
  EXPECT_EQ(sut_.reclaim(), 1U);
  EXPECT_FALSE(sut_.record(5));
  ASSERT_TRUE(sut_.record(6));
  EXPECT_EQ(sut_.record(6)->name.view(), "second");
}

TEST_F(NodesAcrossContainers, BlocksComeFromThereAndTheEndIsSeenInTheNextTick) {
  TestNode receiver = join("receiver");
  BlockChannel channel = receiver.channel();
  step_ = 0;
  InAnotherNamespace other([&] {
    TestNode sender = join("sender");
    BlockChannel out = sender.channel();
    for (;;) {
      sender.router->serve(MonotonicClock::now());
      (void)out.send(receiver.address(), bytes_of("hello"));
      std::this_thread::sleep_for(milliseconds(1));
    }
    return 0;
  });
  const auto serve_until = [&](const auto& done) {
    for (const TimePoint end = MonotonicClock::now() + std::chrono::seconds(20);
         MonotonicClock::now() < end;) {
      receiver.router->serve(MonotonicClock::now());
      if (done()) return true;
      std::this_thread::sleep_for(milliseconds(1));
    }
    return false;
  };
  EXPECT_TRUE(serve_until([&] { return receiver.next(channel) == "hello"; }));
  other.kill();
  EXPECT_TRUE(serve_until([&] { return !sut_.find("sender"); })) << "its end was not seen";
}

TEST_F(NodesAcrossContainers, ChildOfForkDoesNotKeepTheNodeOfItsParent) {
  const NodeLife life = sut_.join({.name = "held"}).value();
  ::prctl(PR_SET_CHILD_SUBREAPER, 1);  // the child of a child is waited for here
  const pid_t parent = ::fork();
  if (parent == 0) {
    NodeDirectory own = NodeDirectory::open(pool()).value();
    const bool joined = own.join({.name = "parent", .forced_address = 5}).has_value();
    const pid_t child = ::fork();
    if (child == 0) {
      ::alarm(20);
      ::pause();
    }
    step_ = child;
    ::_exit(joined ? 0 : 1);
  }
  int status = -1;
  ::waitpid(parent, &status, 0);
  EXPECT_EQ(status, 0);
  EXPECT_EQ(sut_.reclaim(), 1U) << "the child of that process still runs";
  EXPECT_TRUE(sut_.record(life.node));
  const pid_t child = step_;
  ASSERT_GT(child, 0);
  ::kill(child, SIGKILL);
  EXPECT_EQ(::waitpid(child, &status, 0), child);
  ::prctl(PR_SET_CHILD_SUBREAPER, 0);
}

TEST_F(NodesAcrossContainers, ProgramThatClosesTheLocksGetsThemAgain) {
  const NodeEntry entry{.name = "a"};
  const NodeLife life = sut_.join(entry).value();
  const std::string path = MemoryFile::path(node_locks_name(pool_memory_name(pool(), kDefaultBlockBase)));
  // As a program that reads all files of the folder: the kernel gives all locks on that one back.
  ::close(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  EXPECT_TRUE(sut_.has_ended(life.node));
  EXPECT_TRUE(sut_.keep(life, entry));
  EXPECT_FALSE(sut_.has_ended(life.node));
  EXPECT_EQ(sut_.reclaim(), 0U);
}

TEST_F(NodesAcrossContainers, AddressWhoseRecordWasWipedOutIsNotGivenToAnother) {
  auto other = join_inside("a", 5);
  sut_.slot(5).record.write({});
  ASSERT_FALSE(sut_.record(5));
  const auto refused = sut_.join({.name = "b", .forced_address = 5});
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("wiped out"));
  other.kill();
  EXPECT_TRUE(sut_.join({.name = "b", .forced_address = 5}));
}

TEST_F(NodesAcrossContainers, RemovedFileOfLocksLeavesNodesOfThisNamespaceKnownByTheirNumbers) {
  const NodeLife life = sut_.join({.name = "a"}).value();
  NodeLocks::remove(pool_memory_name(pool(), kDefaultBlockBase));
  EXPECT_EQ(NodeDirectory::open(pool())->reclaim(), 0U);
  EXPECT_EQ(sut_.reclaim(), 0U);
  EXPECT_TRUE(sut_.record(life.node));
}

}  // namespace
}  // namespace plchost
