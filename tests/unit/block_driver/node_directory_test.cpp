#include "shm/block_driver/node_directory.hpp"

#include <array>
#include <set>

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include "shm/pool/object_pool.hpp"
#include "shm/threads/process_start.hpp"
#include "tests/unit/pool/unique_pool_name.hpp"

namespace plchost {
namespace {

using testing::HasSubstr;

class NodeDirectoryTest : public testing::Test {
 protected:
  NodeDirectoryTest() : sut_(NodeDirectory::open(pool_.get()).value()) {}
  ~NodeDirectoryTest() override { NodeDirectory::remove(pool_.get()); }

  Result<NodeLife> join(const std::string& name, std::uint16_t forced = 0) {
    return sut_.join({.name = name, .forced_address = forced});
  }
  /// A process that joins and ends without a word.
  void join_and_die(const std::string& name, std::uint16_t forced = 0) {
    const pid_t child = ::fork();
    if (child == 0) ::_exit(join(name, forced) ? 0 : 1);
    int status = -1;
    ::waitpid(child, &status, 0);
    ASSERT_EQ(status, 0);
  }

  UniquePoolName pool_;
  NodeDirectory sut_;
};

TEST_F(NodeDirectoryTest, GivesEachNodeAnAddressOfItsOwnUntilAllAreTaken) {
  std::set<std::uint16_t> addresses;
  for (std::uint32_t i = 0; i < kMaxNodes; ++i) {
    const auto life = join("node" + std::to_string(i));
    ASSERT_TRUE(life) << life.error().describe();
    EXPECT_TRUE(addresses.insert(life->node).second);
  }
  EXPECT_EQ(*addresses.begin(), 1);
  EXPECT_EQ(*addresses.rbegin(), kMaxNodes);
  const auto refused = join("one-more");
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::full);
}

TEST_F(NodeDirectoryTest, ANameGetsTheAddressThatItHadBefore) {
  const NodeLife before = join("a").value();
  const NodeLife other = join("b").value();
  sut_.leave(before);
  EXPECT_NE(join("c")->node, before.node);
  const NodeLife again = join("a").value();
  EXPECT_EQ(again.node, before.node);
  EXPECT_NE(again.generation, before.generation);
  EXPECT_NE(again.node, other.node);
}

TEST_F(NodeDirectoryTest, AForcedAddressThatIsTakenIsRefusedAndSaysByWhom) {
  ASSERT_EQ(join("a", 17)->node, 17);
  const auto refused = join("b", 17);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::already_exists);
  EXPECT_THAT(refused.error().message, HasSubstr("node address 17 is taken: node 'a'"));
  EXPECT_THAT(refused.error().message, HasSubstr(std::to_string(::getpid())));
}

TEST_F(NodeDirectoryTest, AddressesAndNamesOutsideTheBoundsAreRefused) {
  EXPECT_TRUE(join("a", kMaxNodes));
  EXPECT_EQ(join("b", kMaxNodes + 1).error().code, ErrorCode::invalid_argument);
  EXPECT_TRUE(join(std::string(kMaxInstanceName, 'x')));
  EXPECT_EQ(join(std::string(kMaxInstanceName + 1, 'x')).error().code, ErrorCode::invalid_argument);
  EXPECT_EQ(join("").error().code, ErrorCode::invalid_argument);
  EXPECT_EQ(join("a").error().code, ErrorCode::already_exists);
  EXPECT_EQ(sut_.join({.name = "q", .queue_slots = 1000}).error().code, ErrorCode::invalid_argument);
  EXPECT_TRUE(NodeDirectory::open(pool_.get(), std::string(kMaxBlockBase, 'b')));
  NodeDirectory::remove(pool_.get(), std::string(kMaxBlockBase, 'b'));
  EXPECT_FALSE(NodeDirectory::open(pool_.get(), std::string(kMaxBlockBase + 1, 'b')));
}

TEST_F(NodeDirectoryTest, TheAddressOfADeadProcessIsFreeAndItsLinksAreGone) {
  join_and_die("a", 5);
  const auto dead = sut_.record(5);
  ASSERT_TRUE(dead);
  ASSERT_TRUE(LinkMemory::make(sut_.link(5, 6), {5, 1}, {6, 1}, kMinRingSlots));
  EXPECT_EQ(sut_.reclaim(), 1U);
  EXPECT_FALSE(sut_.record(5));
  EXPECT_EQ(LinkMemory::open_to_read(sut_.link(5, 6)).error().code, ErrorCode::not_found);
  EXPECT_EQ(sut_.reclaim(), 0U);
}

TEST_F(NodeDirectoryTest, WhoJoinsTakesTheForcedAddressOfADeadProcess) {
  join_and_die("a", 5);
  const auto life = join("b", 5);
  ASSERT_TRUE(life) << life.error().describe();
  EXPECT_EQ(sut_.record(5)->name.view(), "b");
}

TEST_F(NodeDirectoryTest, AnotherProcessOfTheSameNumberIsNotTakenForTheOldOne) {
  const NodeLife life = join("a").value();
  auto record = sut_.record(life.node).value();
  record.locks_file = 0;      // of a version before, which is known by its number
  record.process.start -= 1;  // as if this process had got the number of one before it
  sut_.slot(life.node).record.write(record);
  EXPECT_EQ(sut_.reclaim(), 1U);
}

TEST_F(NodeDirectoryTest, AProgramThatExecReplacedIsNoNodeAnyMore) {
  std::array<int, 2> closed_by_exec{};
  ASSERT_EQ(::pipe2(closed_by_exec.data(), O_CLOEXEC), 0);
  const pid_t child = ::fork();
  if (child == 0) {
    if (join("a", 5)) ::execlp("sleep", "sleep", "60", static_cast<char*>(nullptr));
    ::_exit(1);
  }
  ::close(closed_by_exec[1]);
  char byte = 0;
  EXPECT_EQ(::read(closed_by_exec[0], &byte, 1), 0);
  ::close(closed_by_exec[0]);
  ASSERT_TRUE(sut_.record(5));
  while (look_at_thread(child)->image == 0) ::usleep(1000);
  EXPECT_EQ(sut_.reclaim(), 1U);
  EXPECT_FALSE(sut_.record(5));
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
}

TEST_F(NodeDirectoryTest, ARecordThatAStrangerChangedIsWrittenAgain) {
  const NodeEntry entry{.name = "a"};
  const NodeLife life = sut_.join(entry).value();
  for (const bool half : {false, true}) {
    auto* const words = reinterpret_cast<std::uint64_t*>(&sut_.slot(life.node).record);
    std::fill_n(words + (half ? 0 : 1), 6, 0x4141414141414141);  // half: looks as if being written for ever
    EXPECT_FALSE(sut_.record(life.node).has_value() && sut_.record(life.node)->process.pid == ::getpid());
    ASSERT_TRUE(sut_.keep(life, entry));
    ASSERT_TRUE(sut_.record(life.node));
    EXPECT_EQ(sut_.record(life.node)->name.view(), "a");
  }
}

TEST_F(NodeDirectoryTest, IsNotReplacedByAMemoryOfItsName) {
  auto pool = ObjectPool::create(pool_.get()).value();
  const auto memory = pool.create_memory("blocks", 5000);
  ASSERT_FALSE(memory);
  EXPECT_EQ(memory.error().code, ErrorCode::refused);
  EXPECT_THAT(memory.error().message, HasSubstr("in use"));
  EXPECT_TRUE(NodeDirectory::open_to_read(pool_.get()));
}

TEST_F(NodeDirectoryTest, OverWhichAStrangerHasWrittenIsMended) {
  const NodeEntry entry{.name = "a"};
  const auto life = sut_.join(entry);
  ASSERT_TRUE(life);
  sut_.layout().magic ^= 0x40;
  sut_.layout().version = 99;
  EXPECT_FALSE(NodeDirectory::open_to_read(pool_.get()));
  ASSERT_TRUE(sut_.keep(*life, entry));
  EXPECT_TRUE(NodeDirectory::open_to_read(pool_.get())) << "by its user";
  sut_.layout().magic ^= 0x40;
  EXPECT_EQ(NodeDirectory::open(pool_.get()).error().code, ErrorCode::corrupt)
      << "a process that does not mend it uses it: of another version";
  sut_.leave(*life);
  const auto again = NodeDirectory::open(pool_.get());
  ASSERT_TRUE(again) << again.error().describe();
  EXPECT_TRUE(NodeDirectory::open_to_read(pool_.get())) << "by the next one when nobody uses it";
}

TEST_F(NodeDirectoryTest, RefusesAFileThatIsNoDirectory) {
  const std::string other = pool_.get() + "x";
  ASSERT_TRUE(MemoryFile::create(other + ".memory.blocks", 100'000));
  const auto opened = NodeDirectory::open(other);
  EXPECT_EQ(opened.error().code, ErrorCode::corrupt);
  MemoryFile::remove(other + ".memory.blocks");
}

}  // namespace
}  // namespace plchost
