#include "shm/block_driver/slot_ring.hpp"

#include <algorithm>
#include <cstring>
#include <random>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

namespace plchost {
namespace {

constexpr std::uint32_t kSlots = kMinRingSlots;

std::vector<std::byte> contents_of(std::size_t size, unsigned seed) {
  std::vector<std::byte> contents(size);
  std::minstd_rand random(seed + 1);
  for (std::byte& byte : contents) byte = static_cast<std::byte>(random());
  return contents;
}

BlockHeader header_for(std::uint32_t channel) {
  BlockHeader header;
  header.destination = NodeAddress{.host = 0, .node = 2}.number();
  header.source = NodeAddress{.host = 0, .node = 1}.number();
  header.channel = channel;
  return header;
}

class SlotRing : public testing::Test {
 protected:
  SlotRing() : descriptors_(kSlots), bytes_(kSlots * kSlotSize), buffer_(kMaxBlockSize) {}

  RingMemory memory() {
    return {.head = &head_,
            .published = &published_,
            .descriptors = descriptors_.data(),
            .bytes = bytes_.data(),
            .slots = kSlots};
  }
  PutResult put(RingWriter& writer, std::uint32_t channel, std::size_t size, unsigned seed = 0) {
    return writer.put(header_for(channel), contents_of(size, seed));
  }
  /// The next block of that channel, or of any.
  TakeResult take(RingReader& reader, std::uint32_t channel = 0) {
    return reader.take(
        [&](const BlockTag& tag, std::uint32_t) { return channel == 0 || tag.channel == channel; }, buffer_,
        header_);
  }
  [[nodiscard]] std::vector<std::byte> taken() const {
    return {buffer_.begin(), buffer_.begin() + header_.size};
  }

  std::atomic<std::uint64_t> head_{0};
  std::atomic<std::uint64_t> published_{0};
  std::vector<SlotDescriptor> descriptors_;
  std::vector<std::byte> bytes_;
  std::vector<std::byte> buffer_;
  BlockHeader header_;
};

TEST_F(SlotRing, GivesBackWhatWasPutInOfEachSizeUpToTheLargest) {
  RingWriter writer(memory());
  RingReader reader(memory());
  unsigned seed = 0;
  for (const std::size_t size :
       {0UL, 1UL, 64UL, 207UL, 208UL, 209UL, 512UL, 4096UL, kMaxBlockSize - 1, kMaxBlockSize}) {
    ASSERT_EQ(put(writer, 7, size, ++seed), PutResult::put) << size;
    ASSERT_EQ(take(reader), TakeResult::taken) << size;
    EXPECT_EQ(header_.channel, 7U);
    EXPECT_EQ(taken(), contents_of(size, seed));
    EXPECT_EQ(take(reader), TakeResult::none);
  }
}

TEST_F(SlotRing, GoesOnAtItsBeginningForManyRounds) {
  RingWriter writer(memory());
  RingReader reader(memory());
  for (unsigned i = 0; i < 2000; ++i) {
    const std::size_t size = (i * 7919) % 6000;
    ASSERT_EQ(put(writer, 1, size, i), PutResult::put) << i;
    ASSERT_EQ(take(reader), TakeResult::taken) << i;
    ASSERT_EQ(taken(), contents_of(size, i)) << i;
  }
  EXPECT_GT(reader.head(), 10U * kSlots);
  EXPECT_EQ(reader.damaged(), 0U);
}

TEST_F(SlotRing, HoldsAsManyBlocksAsItHasSlotsAndThenIsFull) {
  RingWriter writer(memory());
  RingReader reader(memory());
  for (std::uint32_t i = 0; i < kSlots; ++i) ASSERT_EQ(put(writer, 1, 10), PutResult::put);
  EXPECT_EQ(put(writer, 1, 0), PutResult::full);
  EXPECT_FALSE(writer.has_room(1));
  ASSERT_EQ(take(reader), TakeResult::taken);
  EXPECT_TRUE(writer.has_room(1));
  EXPECT_EQ(put(writer, 1, kSlotSize), PutResult::full);  // two slots
  EXPECT_EQ(put(writer, 1, 10), PutResult::put);
}

TEST_F(SlotRing, GivesEachChannelItsOwnInTheirOrderWhateverLiesBetween) {
  RingWriter writer(memory());
  RingReader reader(memory());
  for (unsigned i = 0; i < 30; ++i) ASSERT_EQ(put(writer, 1 + i % 3, 100 * i, i), PutResult::put);
  for (const std::uint32_t channel : {2U, 3U, 1U}) {
    for (unsigned i = channel - 1; i < 30; i += 3) {
      ASSERT_EQ(take(reader, channel), TakeResult::taken);
      EXPECT_EQ(taken(), contents_of(100 * i, i));
    }
    EXPECT_EQ(take(reader, channel), TakeResult::none);
  }
  EXPECT_EQ(reader.head(), reader.end_of_published());
  EXPECT_EQ(head_.load(), reader.head());
}

TEST_F(SlotRing, LetsABlockWaitForALargerBuffer) {
  RingWriter writer(memory());
  RingReader reader(memory());
  ASSERT_EQ(put(writer, 1, 100, 5), PutResult::put);
  std::vector<std::byte> small(99);
  const auto any = [](const BlockTag&, std::uint32_t) { return true; };
  EXPECT_EQ(reader.take(any, small, header_), TakeResult::too_small);
  EXPECT_EQ(header_.size, 100U);
  ASSERT_EQ(take(reader), TakeResult::taken);
  EXPECT_EQ(taken(), contents_of(100, 5));
}

// A task that was interrupted between taking its slots and filling them.
TEST_F(SlotRing, ABlockThatIsNotThereYetDoesNotHinderThoseBehindIt) {
  RingWriter writer(memory());
  RingReader reader(memory());
  ASSERT_EQ(put(writer, 1, 300, 1), PutResult::put);
  const std::uint64_t written = descriptors_[0].position.exchange(0);
  ASSERT_EQ(put(writer, 1, 300, 2), PutResult::put);
  ASSERT_EQ(put(writer, 1, 300, 3), PutResult::put);
  for (const unsigned seed : {2U, 3U}) {
    ASSERT_EQ(take(reader), TakeResult::taken);
    EXPECT_EQ(taken(), contents_of(300, seed));
  }
  EXPECT_EQ(take(reader), TakeResult::none);
  EXPECT_EQ(head_.load(), 0U);
  descriptors_[0].position.store(written);
  ASSERT_EQ(take(reader), TakeResult::taken);
  EXPECT_EQ(taken(), contents_of(300, 1));
  EXPECT_EQ(head_.load(), 6U);
}

TEST_F(SlotRing, DropsADamagedBlockAndCountsIt) {
  RingWriter writer(memory());
  RingReader reader(memory());
  ASSERT_EQ(put(writer, 1, 1000, 1), PutResult::put);
  ASSERT_EQ(put(writer, 1, 1000, 2), PutResult::put);
  bytes_[sizeof(BlockHeader) + 700] ^= std::byte{4};
  ASSERT_EQ(take(reader), TakeResult::taken);
  EXPECT_EQ(taken(), contents_of(1000, 2));
  EXPECT_EQ(reader.damaged(), 1U);
}

TEST_F(SlotRing, EachFlippedBitOfHeaderAndContentsIsSeen) {
  constexpr std::size_t kSize = 40;
  for (std::size_t bit = 0; bit < (sizeof(BlockHeader) + kSize) * 8; ++bit) {
    RingWriter writer(memory());
    RingReader reader(memory());
    std::ranges::fill(bytes_, std::byte{0});
    descriptors_[0].position.store(0);
    head_.store(0);
    ASSERT_EQ(put(writer, 1, kSize, 1), PutResult::put);
    bytes_[bit / 8] ^= static_cast<std::byte>(1 << (bit % 8));
    EXPECT_EQ(take(reader), TakeResult::none) << bit;
    EXPECT_EQ(reader.damaged(), 1U) << bit;
  }
}

TEST_F(SlotRing, PartsOfTwoBlocksThatWereExchangedAreSeen) {
  RingWriter writer(memory());
  RingReader reader(memory());
  ASSERT_EQ(put(writer, 1, 2000, 1), PutResult::put);
  ASSERT_EQ(put(writer, 1, 2000, 2), PutResult::put);
  const auto slot = [&](std::size_t index) {
    return std::span(bytes_).subspan(index * kSlotSize, kSlotSize);
  };
  std::ranges::swap_ranges(slot(3), slot(3 + slots_for(2000)));
  EXPECT_EQ(take(reader), TakeResult::none);
  EXPECT_EQ(reader.damaged(), 2U);
  ASSERT_EQ(put(writer, 1, 2000, 3), PutResult::put);
  std::memcpy(slot(2 * slots_for(2000) + 1).data(), slot(2 * slots_for(2000) + 2).data(), kSlotSize);
  EXPECT_EQ(take(reader), TakeResult::none);
  EXPECT_EQ(reader.damaged(), 3U);
}

TEST_F(SlotRing, SaysThatItIsBrokenWhenTheReadersWordCannotBe) {
  RingWriter writer(memory());
  for (std::uint32_t i = 0; i < kSlots; ++i) ASSERT_EQ(put(writer, 1, 0), PutResult::put);
  for (const std::uint64_t wrong : {std::uint64_t{kSlots} + 1, ~std::uint64_t{0}, std::uint64_t{1} << 40}) {
    head_.store(wrong);
    EXPECT_EQ(put(writer, 1, 0), PutResult::broken);
  }
  head_.store(1);
  EXPECT_EQ(put(writer, 1, 0), PutResult::put);
}

TEST_F(SlotRing, ThreadsOnBothSidesLoseAndDoubleNothing) {
  constexpr unsigned kThreads = 3;
  constexpr unsigned kEach = 3000;
  RingWriter writer(memory());
  RingReader reader(memory());
  std::vector<std::atomic<int>> seen(kThreads * kEach);
  std::atomic<unsigned> left{kThreads * kEach};
  std::vector<std::thread> threads;
  for (unsigned t = 0; t < kThreads; ++t) {
    threads.emplace_back([&, t] {
      for (unsigned i = 0; i < kEach; ++i) {
        std::vector<std::byte> contents = contents_of(4 + (i * 37) % 900, i);
        const unsigned number = t * kEach + i;
        std::memcpy(contents.data(), &number, sizeof number);
        while (writer.put(header_for(1), contents) != PutResult::put) std::this_thread::yield();
      }
    });
    threads.emplace_back([&] {
      std::vector<std::byte> buffer(kMaxBlockSize);
      BlockHeader header;
      while (left.load() > 0) {
        const auto any = [](const BlockTag&, std::uint32_t) { return true; };
        if (reader.take(any, buffer, header) != TakeResult::taken) {
          std::this_thread::yield();
          continue;
        }
        unsigned number = 0;
        std::memcpy(&number, buffer.data(), sizeof number);
        seen.at(number).fetch_add(1);
        left.fetch_sub(1);
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  for (const auto& count : seen) ASSERT_EQ(count.load(), 1);
  EXPECT_EQ(reader.damaged(), 0U);
  EXPECT_EQ(reader.taken(), kThreads * kEach);
  EXPECT_EQ(head_.load(), reader.head());
}

}  // namespace
}  // namespace plchost
