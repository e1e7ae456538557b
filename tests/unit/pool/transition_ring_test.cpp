#include "shm/pages/transition_ring.hpp"

#include <set>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <grp.h>
#include <sys/stat.h>
#include <sys/xattr.h>
#include <unistd.h>

#include "shm/files/memory_file.hpp"
#include "tests/support/in_a_child.hpp"
#include "tests/unit/pool/unique_pool_name.hpp"

namespace plchost {
namespace {

using std::chrono::seconds;

class Transitions : public testing::Test {
 protected:
  ~Transitions() override { TransitionRing::remove(pool(), "line1"); }
  [[nodiscard]] const std::string& pool() const { return name_.get(); }
  TransitionRing writer() { return std::move(TransitionRing::open(pool(), "line1").value()); }
  TransitionRingReader reader() { return std::move(TransitionRingReader::open(pool(), "line1").value()); }
  std::vector<std::uint64_t> numbers(TransitionRingReader& reader) {
    std::vector<std::uint64_t> seen;
    while (const auto next = reader.next(now_)) seen.push_back(next->sequence);
    return seen;
  }

  UniquePoolName name_;
  TimePoint now_{seconds(1000)};
};

TEST_F(Transitions, ComeOnceInOrderWithTimesAndReasons) {
  TransitionRing ring = writer();
  TransitionRingReader sut = reader();
  ring.add(TransitionSource::application, 1, 2, 4711, "start");
  ring.add(TransitionSource::process, 2, 8, 4711, "fault");
  const auto first = sut.next(now_);
  const auto second = sut.next(now_);
  ASSERT_TRUE(first && second);
  EXPECT_FALSE(sut.next(now_));
  EXPECT_EQ(first->sequence, 1U);
  EXPECT_EQ(first->from, 1U);
  EXPECT_EQ(first->to, 2U);
  EXPECT_EQ(first->pid, 4711);
  EXPECT_EQ(first->reason.view(), "start");
  EXPECT_EQ(second->sequence, 2U);
  EXPECT_EQ(second->source, TransitionSource::process);
  EXPECT_GT(first->time_unix_ns, 0);
  EXPECT_LE(first->time_monotonic_ns, second->time_monotonic_ns);
}

TEST_F(Transitions, AreNumberedOverAllWritersAndTheirEnds) {
  {
    TransitionRing first = writer();
    first.add(TransitionSource::application, 0, 1, 1, "");
  }
  TransitionRing second = writer();
  TransitionRing third = writer();
  second.add(TransitionSource::application, 0, 1, 2, "");
  third.add(TransitionSource::process, 0, 1, 2, "");
  TransitionRingReader sut = reader();
  EXPECT_THAT(numbers(sut), testing::ElementsAre(1, 2, 3));
}

TEST_F(Transitions, ThatWereOvertakenAreAGapInTheNumbers) {
  TransitionRing ring = writer();
  TransitionRingReader sut = reader();
  for (std::size_t i = 0; i < kTransitionsKept + 10; ++i) ring.add(TransitionSource::process, 0, 1, 0, "");
  const auto seen = numbers(sut);
  ASSERT_EQ(seen.size(), kTransitionsKept);
  EXPECT_EQ(seen.front(), 11U);
  EXPECT_EQ(seen.back(), kTransitionsKept + 10);
}

TEST_F(Transitions, OfTwoWritersAtOnceAreAllThere) {
  TransitionRingReader sut = (writer(), reader());
  constexpr int kEach = 20'000;
  std::atomic<int> seen_by_reader{0};
  const auto write = [&](TransitionSource source) {
    TransitionRing ring = writer();
    for (int i = 0; i < kEach; ++i) {
      // As far ahead as the ring is deep, so that nothing may be overtaken.
      while (2 * i - seen_by_reader.load() > 40) std::this_thread::yield();
      ring.add(source, 0, 1, 0, "");
    }
  };
  std::jthread first(write, TransitionSource::application);
  std::jthread second(write, TransitionSource::process);
  std::vector<std::uint64_t> seen;
  while (seen.size() < 2 * kEach) {
    if (const auto next = sut.next(now_)) {
      seen.push_back(next->sequence);
      ++seen_by_reader;
    }
  }
  for (std::size_t i = 0; i < seen.size(); ++i) ASSERT_EQ(seen[i], i + 1);
}

TEST_F(Transitions, WaitForAWriterAndGoOnWithoutOneThatDied) {
  TransitionRing ring = writer();
  TransitionRingReader sut = reader();
  ring.add(TransitionSource::process, 0, 1, 0, "");
  const MemoryFile memory = std::move(
      MemoryFile::open(transition_ring_name(pool(), "line1"), 1, MemoryFile::Access::read_write).value());
  // The state that a writer leaves when it is killed between its number and its slot.
  reinterpret_cast<TransitionRingLayout*>(memory.bytes().data())->last.fetch_add(1);
  ring.add(TransitionSource::process, 1, 2, 0, "");
  EXPECT_THAT(numbers(sut), testing::ElementsAre(1));
  now_ += TransitionRingReader::kWriterGone;
  EXPECT_THAT(numbers(sut), testing::ElementsAre(3));
}

TEST_F(Transitions, RefuseWhatIsNoRing) {
  (void)MemoryFile::replace(transition_ring_name(pool(), "line1"), sizeof(TransitionRingLayout));
  EXPECT_EQ(TransitionRingReader::open(pool(), "line1").error().code, ErrorCode::corrupt);
  EXPECT_EQ(TransitionRingReader::open(pool(), "line2").error().code, ErrorCode::not_found);
  TransitionRing ring = writer();  // a writer makes a good one of it
  EXPECT_TRUE(TransitionRingReader::open(pool(), "line1"));
}

TEST_F(Transitions, OfAnotherVersionAreToldFromWhatIsNone) {
  (void)writer();
  const std::string name = transition_ring_name(pool(), "line1");
  const auto memory = MemoryFile::open(name, 1, MemoryFile::Access::read_write);
  auto& ring = *reinterpret_cast<TransitionRingLayout*>(memory->bytes().data());
  ring.version += 1;
  EXPECT_EQ(TransitionRingReader::open(pool(), "line1").error().message,
            fmt::format("ring of transitions '{0}' has version 2 and {1} bytes; 1 and {1} are needed", name,
                        sizeof(TransitionRingLayout)));
  ring.magic += 1;
  EXPECT_EQ(TransitionRingReader::open(pool(), "line1").error().message,
            fmt::format("shared memory '{}' is not a ring of transitions", name));
}

// Each user of the group reads it.
TEST_F(Transitions, AreWrittenByTheOwnerAndTheUsersOfInstances) {
  (void)writer();
  const std::string path = MemoryFile::path(transition_ring_name(pool(), "line1"));
  const auto mode = [&path] {
    struct stat status{};
    EXPECT_EQ(::stat(path.c_str(), &status), 0);
    return status.st_mode & 07777U;
  };
  EXPECT_EQ(mode(), 0640U);
  if (::geteuid() != 0) GTEST_SKIP() << "only root can be other users";
  const auto writes = [&](uid_t user) {
    return in_a_child([&] {
      const bool can = ::setgroups(0, nullptr) == 0 && ::setresuid(user, user, user) == 0;
      return std::string(can && ::access(path.c_str(), W_OK) == 0 ? "writes" : "does not");
    });
  };
  constexpr uid_t kInstances = 64043;
  ASSERT_TRUE(TransitionRing::let_write(pool(), "line1", {&kInstances, 1}));
  EXPECT_EQ(writes(kInstances), "writes");
  const bool has_list = ::getxattr(path.c_str(), "system.posix_acl_access", nullptr, 0) > 0;
  EXPECT_EQ(writes(kInstances + 1), has_list ? "does not" : "writes") << "it has the group";
  ASSERT_TRUE(TransitionRing::let_write(pool(), "line1", {}));
  EXPECT_EQ(writes(kInstances), "does not");
  EXPECT_EQ(mode(), 0640U);
}

// Each process that may write the ring is a stranger to those that show it.
TEST_F(Transitions, HaveAReasonThatCanBePrinted) {
  TransitionRing ring = writer();
  TransitionRingReader sut = reader();
  ring.add(TransitionSource::application, 1, 2, 4711, "a\x1b[2Jb\xffz");
  const auto seen = sut.next(now_);
  ASSERT_TRUE(seen);
  EXPECT_EQ(seen->reason.view(), "a?[2Jb?z");
}

}  // namespace
}  // namespace plchost
