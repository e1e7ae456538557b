#include "shm/base/crc32c.hpp"

#include <algorithm>
#include <array>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

namespace plchost {
namespace {

std::vector<std::byte> some_bytes(std::size_t size) {
  std::vector<std::byte> bytes(size);
  for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<std::byte>(i * 31 + i / 251);
  return bytes;
}

// Bit by bit, as the polynomial is defined.
std::uint32_t by_definition(std::span<const std::byte> bytes) {
  std::uint32_t state = ~std::uint32_t{0};
  for (const std::byte byte : bytes) {
    state ^= static_cast<std::uint32_t>(byte);
    for (int bit = 0; bit < 8; ++bit) state = (state >> 1) ^ ((state & 1) != 0 ? 0x82F63B78U : 0);
  }
  return ~state;
}

TEST(Crc32c, IsTheChecksumOfItsStandard) {
  // RFC 3720, B.4, and the check value of the catalogue.
  constexpr std::string_view kDigits = "123456789";
  EXPECT_EQ(crc32c(std::as_bytes(std::span(kDigits))), 0xE3069283U);
  EXPECT_EQ(crc32c(std::vector<std::byte>(32, std::byte{0})), 0x8A9136AAU);
  EXPECT_EQ(crc32c(std::vector<std::byte>(32, std::byte{0xff})), 0x62A8AB43U);
  EXPECT_EQ(crc32c({}), 0U);
}

TEST(Crc32c, IsTheSameForEachLengthAndBeginning) {
  const auto bytes = some_bytes(10'000);
  for (const std::size_t size :
       {1U, 7U, 8U, 9U, 383U, 384U, 385U, 3071U, 3072U, 3073U, 6144U, 6145U, 9999U}) {
    for (const std::size_t begin : {0U, 1U}) {
      const auto part = std::span(bytes).subspan(begin, size);
      EXPECT_EQ(crc32c(part), by_definition(part)) << size << " from " << begin;
    }
  }
}

TEST(Crc32c, GoesOnFromWhatCameBefore) {
  const auto bytes = std::span<const std::byte>();
  const auto all = some_bytes(5000);
  for (const std::size_t first : {0U, 1U, 100U, 3072U, 4999U}) {
    EXPECT_EQ(crc32c(std::span(all).subspan(first), crc32c(std::span(all).first(first))), crc32c(all));
  }
  EXPECT_EQ(crc32c(bytes, 17), 17U);
}

TEST(Crc32c, OfACopyIsThatOfTheOriginal) {
  constexpr std::size_t kLargest = 20'001;
  alignas(64) static std::array<std::byte, kLargest + 64> to;
  for (const std::size_t size : {std::size_t{0}, std::size_t{1}, std::size_t{9}, std::size_t{400},
                                 std::size_t{1024}, std::size_t{1300}, std::size_t{3100}, kLargest}) {
    const auto from = some_bytes(size);
    for (const auto copy : {copy_with_crc32c, copy_out_with_crc32c}) {
      for (const std::size_t begin : {0U, 1U, 16U}) {  // at the beginning of a cache line, and within it
        to.fill(std::byte{0xee});
        EXPECT_EQ(copy(to.data() + begin, from, 5), crc32c(from, 5)) << size << " to " << begin;
        EXPECT_TRUE(std::ranges::equal(std::span(to).subspan(begin, size), from));
        EXPECT_EQ(to[begin + size], std::byte{0xee});
      }
    }
  }
}

}  // namespace
}  // namespace plchost
