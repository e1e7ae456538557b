#include "api/dds/gate/handshake_assembly.hpp"

#include <algorithm>
#include <cstdint>
#include <random>
#include <span>
#include <vector>

#include <gtest/gtest.h>

#include "api/dds/gate/packet_gate.hpp"

namespace plchost::dds {
namespace {

using Octets = std::vector<std::uint8_t>;

constexpr std::uint16_t kPiece = 256;

struct FragmentOf {
  std::uint8_t from = 1;     ///< the sender
  std::uint32_t number = 7;  ///< of the sample
  std::uint32_t first = 1;
  std::uint16_t count = 1;
  std::uint16_t size = kPiece;
  std::uint32_t sample_size = 600;
  bool little = true;
};

void put_number(Octets& to, std::uint32_t number, std::size_t bytes, bool little) {
  for (std::size_t i = 0; i < bytes; ++i) {
    to.push_back(static_cast<std::uint8_t>(number >> (8 * (little ? i : bytes - 1 - i))));
  }
}

Octets rtps_header(std::uint8_t from) {
  Octets made{'R', 'T', 'P', 'S', 2, 1, 1, 16};
  made.resize(20, from);
  return made;
}

/// Byte i of a sample is i % 251.
Octets fragment(const FragmentOf& of) {
  const std::uint32_t begin = (of.first - 1) * of.size;
  const std::uint32_t wanted = std::uint32_t{of.count} * of.size;
  const std::uint32_t bytes = begin < of.sample_size ? std::min(wanted, of.sample_size - begin) : wanted;
  const std::uint32_t padded = (bytes + 3) / 4 * 4;
  Octets made{0x16, static_cast<std::uint8_t>(of.little ? 1 : 0)};
  put_number(made, 32 + padded, 2, of.little);
  put_number(made, 0, 2, of.little);
  put_number(made, 28, 2, of.little);
  for (const std::uint8_t byte : {0, 2, 1, 0xc4, 0, 2, 1, 0xc3}) made.push_back(byte);
  put_number(made, 0, 4, of.little);
  put_number(made, of.number, 4, of.little);
  put_number(made, of.first, 4, of.little);
  put_number(made, of.count, 2, of.little);
  put_number(made, of.size, 2, of.little);
  put_number(made, of.sample_size, 4, of.little);
  for (std::uint32_t i = 0; i < padded; ++i) made.push_back(static_cast<std::uint8_t>((begin + i) % 251));
  return made;
}

class HandshakeAssemblyTest : public testing::Test {
 protected:
  /// The bytes that DDS gets; empty: none.
  Octets after_all(const std::vector<Octets>& submessages, std::uint8_t from = 1) {
    Octets datagram = rtps_header(from);
    for (const Octets& one : submessages) datagram.insert(datagram.end(), one.begin(), one.end());
    if (admit(std::as_writable_bytes(std::span(datagram)), true) == Admission::refused)
      return {};  // comes no further
    const std::size_t size = datagram.size();
    datagram.resize(8192);
    datagram.resize(sut_.rewrite(std::as_writable_bytes(std::span(datagram)), size));
    EXPECT_TRUE(datagram.empty() ||
                admit(std::as_writable_bytes(std::span(datagram)), true) == Admission::whole);
    return datagram;
  }
  Octets after(const FragmentOf& of) { return after_all({fragment(of)}, of.from); }

  /// A datagram with that sample, whole.
  static void expect_sample(const Octets& datagram, std::uint32_t size) {
    ASSERT_EQ(datagram.size(), 20U + 24U + (size + 3) / 4 * 4);
    EXPECT_EQ(datagram[20], 0x15);
    EXPECT_EQ(datagram[21], 5);
    EXPECT_EQ(Octets(datagram.begin() + 28, datagram.begin() + 36), (Octets{0, 2, 1, 0xc4, 0, 2, 1, 0xc3}));
    for (std::uint32_t i = 0; i < size; ++i) ASSERT_EQ(datagram[44 + i], i % 251) << i;
  }

  HandshakeAssembly sut_;
};

TEST_F(HandshakeAssemblyTest, PutsAMessageTogetherInWhateverOrder) {
  EXPECT_TRUE(after({.first = 3}).empty());
  EXPECT_TRUE(after({.first = 1}).empty());
  expect_sample(after({.first = 2}), 600);
}

TEST_F(HandshakeAssemblyTest, TakesSeveralFragmentsAtOnceOfEitherByteOrder) {
  EXPECT_TRUE(after({.first = 1, .count = 2, .little = false}).empty());
  const Octets made = after({.first = 3, .little = false});
  expect_sample(made, 600);
  EXPECT_EQ(made[36], 0);  // the number, by words, low end first
  EXPECT_EQ(made[40], 7);
}

TEST_F(HandshakeAssemblyTest, KeepsWhatStandsBesideFragments) {
  const Octets destination{0x0e, 1, 12, 0, 9, 9, 9, 9, 9, 9, 9, 9, 9, 9, 9, 9};
  EXPECT_TRUE(after_all({destination, fragment({.first = 1})}).empty());
  Octets made = after_all({destination, fragment({.first = 2}), fragment({.first = 3})});
  EXPECT_EQ(Octets(made.begin() + 20, made.begin() + 36), destination);
  made.erase(made.begin() + 20, made.begin() + 36);
  expect_sample(made, 600);
}

// This is what ends Cyclone 0.10.2: memory for 600 bytes, and a copy of more.
TEST_F(HandshakeAssemblyTest, TakesNoFragmentThatSaysAnotherSizeThanTheFirst) {
  EXPECT_TRUE(after({.first = 1}).empty());
  EXPECT_TRUE(after({.first = 2, .count = 20, .sample_size = 21 * kPiece}).empty());
  EXPECT_TRUE(after({.first = 2, .count = 2, .size = kPiece + 4}).empty());
  EXPECT_TRUE(after({.first = 2}).empty());
  expect_sample(after({.first = 3}), 600);
}

TEST_F(HandshakeAssemblyTest, KeepsMessagesOfSeveralSendersApart) {
  EXPECT_TRUE(after({.from = 1, .first = 1}).empty());
  EXPECT_TRUE(after({.from = 2, .first = 2}).empty());
  EXPECT_TRUE(after({.from = 1, .number = 8, .first = 3}).empty());
  EXPECT_TRUE(after({.from = 1, .first = 3}).empty());
  expect_sample(after({.from = 1, .first = 2}), 600);
}

TEST_F(HandshakeAssemblyTest, LetsTheOldestMessageGoForANewOne) {
  EXPECT_TRUE(after({.number = 1, .first = 1}).empty());
  for (std::uint32_t i = 0; i < HandshakeAssembly::kSamples; ++i) {
    EXPECT_TRUE(after({.number = 100 + i, .first = 1}).empty());
  }
  EXPECT_TRUE(after({.number = 1, .first = 2, .count = 2}).empty()) << "its first part is gone";
  expect_sample(after({.number = 131, .first = 2, .count = 2}), 600);
}

TEST_F(HandshakeAssemblyTest, RefusesWhatNoFragmentCanBe) {
  EXPECT_TRUE(after({.first = 4}).empty()) << "behind the end";
  EXPECT_TRUE(after({.first = 0}).empty());
  EXPECT_TRUE(after({.first = 1, .count = 0}).empty());
  EXPECT_TRUE(after({.first = 1, .count = 4}).empty());
  EXPECT_TRUE(after({.first = 1, .size = 128}).empty()) << "too small";
  EXPECT_TRUE(after({.first = 1, .count = 1, .size = 60000, .sample_size = HandshakeAssembly::kMaxSample + 1})
                  .empty());
  EXPECT_TRUE(after({.first = 0xffffffff, .count = 2}).empty());
}

TEST_F(HandshakeAssemblyTest, LeavesAllElseAsItIs) {
  const Octets whole{0x33, 1, 8, 0, 1, 2, 3, 4, 5, 6, 7, 8};
  const Octets made = after_all({whole, fragment({.first = 1})});
  EXPECT_EQ(made.size(), 20U + whole.size() + fragment({.first = 1}).size()) << "signed as a whole";
  EXPECT_EQ(after_all({Octets{0x09, 1, 0, 0}}).size(), 24U);
}

TEST_F(HandshakeAssemblyTest, StaysWithinItsBoundsWhateverComes) {
  std::mt19937 random(1);
  for (int i = 0; i < 20'000; ++i) {
    FragmentOf of{.number = static_cast<std::uint32_t>(random() % 3),
                  .first = static_cast<std::uint32_t>(random() % 5),
                  .count = static_cast<std::uint16_t>(random() % 4),
                  .sample_size = 200 + static_cast<std::uint32_t>(random() % 1000)};
    Octets made = fragment(of);
    for (int flip = static_cast<int>(random() % 3); flip > 0; --flip) {
      made[20 + random() % 16] = static_cast<std::uint8_t>(random());
    }
    const Octets passed = after_all({made});
    EXPECT_TRUE(passed.empty() || passed[20] == 0x15);
  }
}

}  // namespace
}  // namespace plchost::dds
