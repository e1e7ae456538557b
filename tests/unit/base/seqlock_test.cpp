#include "shm/base/seqlock.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstring>
#include <memory>
#include <thread>

#include <gtest/gtest.h>

namespace plchost {
namespace {

struct Record {
  std::array<std::uint64_t, 20> words;
};

Record record_of(std::uint64_t value) {
  Record record{};
  record.words.fill(value);
  return record;
}

TEST(Seqlock, AllZeroHoldsAnAllZeroValue) {
  const Seqlock<Record> sut;
  const auto read = sut.read();
  ASSERT_TRUE(read);
  EXPECT_EQ(read->words[19], 0U);
}

TEST(Seqlock, ReadsWhatWasWritten) {
  Seqlock<Record> sut;
  sut.write(record_of(7));
  const auto read = sut.read();
  ASSERT_TRUE(read);
  EXPECT_EQ(read->words, record_of(7).words);
}

TEST(Seqlock, SequenceTellsThatSomethingWasWritten) {
  Seqlock<int> sut;
  const auto before = sut.sequence();
  EXPECT_EQ(sut.sequence(), before);
  sut.write(0);
  EXPECT_NE(sut.sequence(), before);
}

TEST(Seqlock, KeepsValuesWhoseSizeIsNoMultipleOfAWord) {
  struct Odd {
    std::array<char, 11> bytes;
  };
  Seqlock<Odd> sut;
  sut.write(Odd{{"0123456789"}});
  EXPECT_STREQ(sut.read().value().bytes.data(), "0123456789");
}

TEST(Seqlock, IsConsistentInAStormOfWrites) {
  constexpr int kReads = 2'000;
  Seqlock<Record> sut;
  std::atomic<bool> stop{false};
  std::thread writer([&] {
    for (std::uint64_t i = 0; !stop.load(std::memory_order_relaxed); ++i) sut.write(record_of(i));
  });
  std::uint64_t last = 0;
  int reads = 0;
  int changes = 0;
  // So long for a machine that runs the writer or the reader only: neither may be kept out for ever.
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while ((reads < kReads || changes < 10) && std::chrono::steady_clock::now() < end) {
    const auto read = sut.read();
    if (!read) {
      std::this_thread::yield();
      continue;
    }
    ++reads;
    const bool whole = std::ranges::all_of(read->words, [&](auto word) { return word == read->words[0]; });
    EXPECT_TRUE(whole);
    EXPECT_GE(read->words[0], last);
    if (!whole || read->words[0] < last) break;
    changes += read->words[0] > last ? 1 : 0;
    last = read->words[0];
  }
  stop.store(true);
  writer.join();
  EXPECT_GE(reads, kReads) << "the reads failed";
  EXPECT_GE(changes, 10) << "nobody wrote meanwhile";
}

TEST(Seqlock, GivesNothingAfterAWriterDiedUntilRecovered) {
  Seqlock<int> sut;
  sut.write(1);
  // As a writer leaves it that dies inside write(): the sequence, its first word, is odd.
  auto& sequence = *reinterpret_cast<std::atomic<std::uint64_t>*>(&sut);
  sequence.fetch_add(1);
  EXPECT_FALSE(sut.read());
  sut.recover();
  sut.write(2);
  EXPECT_EQ(sut.read(), 2);
}

TEST(Seqlock, RecoverLeavesASoundOneAlone) {
  Seqlock<int> sut;
  sut.write(1);
  const auto before = sut.sequence();
  sut.recover();
  EXPECT_EQ(sut.sequence(), before);
  EXPECT_EQ(sut.read(), 1);
}

}  // namespace
}  // namespace plchost
