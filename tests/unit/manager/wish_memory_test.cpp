// The wish of an instance, in memory that another program writes over, or whose writer is killed.

#include <algorithm>
#include <cstddef>
#include <fstream>
#include <span>
#include <string_view>
#include <vector>

#include "shm/guard/memory_guard.hpp"
#include "tests/unit/manager/wish_store_fixture.hpp"

namespace plchost {
namespace {

constexpr std::size_t kWishHeader = 16;  // magic, version, size; two places of the same size follow

/// The memory of line1, as a stranger has it.
class RawWishMemory {
 public:
  explicit RawWishMemory(const std::string& pool)
      : file_(MemoryFile::open(pool + ".wish.line1", 1, MemoryFile::Access::read_write).value()) {}
  [[nodiscard]] std::span<std::byte> bytes() const { return file_.bytes(); }
  [[nodiscard]] std::span<std::byte> place(std::size_t number) const {
    const std::size_t size = (bytes().size() - kWishHeader) / 2;
    return bytes().subspan(kWishHeader + number * size, size);
  }
  [[nodiscard]] std::vector<std::byte> copy() const { return {bytes().begin(), bytes().end()}; }

 private:
  MemoryFile file_;
};

TEST_F(WishStoreTest, LeavesAWholeOneWhenItIsKilledInAWrite) {
  ASSERT_TRUE(sut_->find());
  InstanceWish wish = some_wish();
  sut_->keep(wish);
  const RawWishMemory memory(pool_);
  const std::vector<std::byte> before = memory.copy();
  wish.restarts = 8;
  sut_->keep(wish);
  const std::vector<std::byte> after = memory.copy();
  // The state after a kill: a part of the place that is written first, then that place whole.
  for (const std::size_t first : {0U, 1U}) {
    const std::span place = memory.place(first);
    const auto begin = place.data() - memory.bytes().data();
    for (const std::size_t written : {std::size_t{0}, std::size_t{8}, std::size_t{100}, place.size()}) {
      std::ranges::copy(before, memory.bytes().begin());
      std::ranges::fill(place.first(8), std::byte{0});
      if (written > 8)
        std::ranges::copy_n(after.begin() + begin + 8, static_cast<long>(written) - 8, place.begin() + 8);
      if (written == place.size()) std::ranges::copy_n(after.begin() + begin, 8, place.begin());
      make();
      EXPECT_EQ(sut_->find().value()->restarts, written == place.size() ? 8U : 7U) << first << " " << written;
    }
  }
}

// No disk has it yet.
TEST_F(WishStoreTest, KeepsAnOperatorsStopWhateverByteOfTheMemoryIsAnotherOne) {
  std::ofstream(state()) << "in the way";
  ASSERT_TRUE(sut_->find());
  InstanceWish wish = some_wish();
  wish.running = true;
  sut_->keep(wish);
  wish.running = false;
  EXPECT_NE(keep(wish), "");
  const RawWishMemory memory(pool_);
  const std::vector<std::byte> whole = memory.copy();
  const std::size_t text = encode(wish).size() + 32;
  for (const std::size_t place : {0U, 1U}) {
    for (std::size_t i = 0; i < text; ++i) {
      memory.place(place)[i] ^= std::byte{0x55};
      make();
      const auto found = sut_->find();
      ASSERT_TRUE(found) << i;
      ASSERT_TRUE(*found) << i;
      ASSERT_FALSE((*found)->running) << i;
      std::ranges::copy(whole, memory.bytes().begin());
    }
  }
}

// The disk has not taken the stop when another program writes over both places, or over the head.
TEST_F(WishStoreTest, TakesNoOlderStartFromTheDiskForAStopThatIsDamaged) {
  ASSERT_TRUE(sut_->find());
  InstanceWish wish = some_wish();
  wish.running = true;
  ASSERT_EQ(keep(wish), "");
  const std::string older = file() + ".older";
  std::filesystem::copy_file(file(), older);
  wish.running = false;
  ASSERT_EQ(keep(wish), "");
  const std::vector<std::byte> whole = RawWishMemory(pool_).copy();
  std::filesystem::rename(older, file());
  const std::string kept = file() + ".kept";
  std::filesystem::copy_file(file(), kept);
  make();
  EXPECT_FALSE(sut_->find().value()->running) << "the memory has it";
  for (const std::size_t begin : {std::size_t{0}, std::size_t{8}, kWishHeader + 16}) {
    WishMemory::remove(pool_, "line1");
    make();
    ASSERT_TRUE(sut_->find().value()->running) << "as after a power cut";
    WishMemory::remove(pool_, "line1");
    ASSERT_TRUE(MemoryFile::create(pool_ + ".wish.line1", whole.size(), [&](std::span<std::byte> bytes) {
      std::ranges::copy(whole, bytes.begin());
      std::ranges::fill(bytes.subspan(begin), std::byte{0xff});
      return Result<void>();
    }));
    // So does each later manager: after one that was killed, and after one that ended in order.
    for (const char* const manager : {"first", "after a kill", "after an end in order"}) {
      make();
      const auto found = sut_->find();
      ASSERT_FALSE(found) << begin << " " << manager;
      EXPECT_EQ(found.error().code, ErrorCode::corrupt);
      EXPECT_THAT(found.error().message, testing::HasSubstr("may be older"));
      if (manager != std::string_view("first")) sut_->end();
    }
    wish.restarts = static_cast<std::uint32_t>(begin);
    ASSERT_EQ(keep(wish), "");
    make();
    EXPECT_EQ(sut_->find().value(), wish) << "an operator has said it again";
    std::filesystem::copy_file(kept, file(), std::filesystem::copy_options::overwrite_existing);
  }
}

TEST_F(WishStoreTest, WritesAnewWhatAnotherProgramHasWrittenOver) {
  MemoryGuard::watch_process();
  ASSERT_TRUE(sut_->find());
  sut_->look_after_memory();
  sut_->keep(some_wish());
  const RawWishMemory memory(pool_);
  const std::vector<std::byte> whole = memory.copy();
  sut_->look_after_memory();
  EXPECT_EQ(memory.copy(), whole);
  std::ranges::fill(memory.bytes(), std::byte{0});
  sut_->look_after_memory();
  EXPECT_EQ(memory.copy(), whole);
  std::filesystem::resize_file(MemoryFile::path(pool_ + ".wish.line1"), 0);
  sut_->look_after_memory();
  EXPECT_EQ(RawWishMemory(pool_).copy(), whole);
  make();
  EXPECT_EQ(sut_->find().value(), some_wish());
  sut_->look_after_memory();
  EXPECT_EQ(RawWishMemory(pool_).copy(), whole);
}

}  // namespace
}  // namespace plchost
