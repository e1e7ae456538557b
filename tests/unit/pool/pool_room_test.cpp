#include "shm/pool/pool_room.hpp"

#include <limits>
#include <string>

#include <gmock/gmock.h>
#include <sys/wait.h>
#include <unistd.h>

#include "shm/pool/object_pool.hpp"
#include "tests/support/own_name.hpp"

namespace plchost {
namespace {

using testing::HasSubstr;

constexpr std::uint64_t kPage = 4096;

class RoomInPool : public testing::Test {
 protected:
  RoomInPool() : name_(own_name("room")), pool_(ObjectPool::create(name_)) {}
  ~RoomInPool() override { ObjectPool::remove(name_); }
  PoolRoom room(std::uint64_t free_bytes, pid_t process = 0) {
    return *PoolRoom::of(*pool_, "line1", process, free_bytes);
  }

  std::string name_;
  Result<ObjectPool> pool_;
};

TEST_F(RoomInPool, HasBytesForWholePagesOnly) {
  PoolRoom exact = room(2 * kPage);
  EXPECT_TRUE(exact.take_memory("one", kPage));
  EXPECT_TRUE(exact.take_memory("two", 1));
  const auto third = exact.take_memory("three", 1);
  ASSERT_FALSE(third);
  EXPECT_EQ(third.error().code, ErrorCode::full);
  EXPECT_THAT(third.error().message, HasSubstr("for 'three': /dev/shm has room for 0"));
  EXPECT_FALSE(room(2 * kPage - 1).take_memory("one", kPage + 1));
}

TEST_F(RoomInPool, TakesOneMemoryOnce) {
  PoolRoom once = room(kPage);
  EXPECT_TRUE(once.take_memory("one", kPage));
  EXPECT_TRUE(once.take_memory("one", kPage));
  EXPECT_EQ(once.take("one").error().code, ErrorCode::wrong_type);
}

TEST_F(RoomInPool, HasNoLimitWhereTheHostSetsNone) {
  PoolRoom endless = room(std::numeric_limits<std::uint64_t>::max());
  const std::uint64_t most = std::uint64_t{1} << 62;
  for (const char* name : {"one", "two", "three", "four", "five"}) {
    EXPECT_TRUE(endless.take_memory(name, most));
  }
}

// A memory that goes with the old process makes room; one that is kept, or that others have, does not.
TEST_F(RoomInPool, CountsWhatTheOldProcessGivesBack) {
  const auto own = pool_->create_memory("own", 3 * kPage);
  ASSERT_TRUE(own);
  EXPECT_FALSE(room(0, ::getpid() + 1).take_memory("new", 1)) << "another process has it";
  EXPECT_TRUE(room(0, ::getpid()).take_memory("new", 3 * kPage));
  EXPECT_FALSE(room(0, ::getpid()).take_memory("new", 3 * kPage + 1));
  ASSERT_TRUE(pool_->create_memory("kept", kPage, {.keep = true}));
  EXPECT_FALSE(room(0, ::getpid()).take_memory("new", 4 * kPage));
}

// A trial only reads the pool, so it releases nothing itself.
TEST_F(RoomInPool, CountsNothingOfAProcessThatHasJustEnded) {
  const pid_t child = ::fork();
  if (child == 0) {
    auto pool = ObjectPool::attach(name_);
    static auto held = pool->create_memory("old", 3 * kPage);
    ::_exit(held ? 0 : 1);
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  ASSERT_EQ(status, 0);
  const auto read_only = ObjectPool::attach(name_, ObjectPool::Access::read_only);
  ASSERT_TRUE(read_only);
  ASSERT_EQ(read_only->look_at("old")->references.size(), 1U) << "nobody has released it yet";
  auto after = PoolRoom::of(*read_only, "line1", 0, 0);
  ASSERT_TRUE(after);
  EXPECT_TRUE(after->take_memory("new", 3 * kPage));
}

TEST(FreeSharedMemory, IsMoreThanNothing) {
  EXPECT_GT(free_shared_memory(), 0U);
}

}  // namespace
}  // namespace plchost
