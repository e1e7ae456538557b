// The state of a debugger in shared memory, read in parts.
#include "shm/pages/debug_page.hpp"

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "shm/files/pool_files.hpp"
#include "tests/support/own_name.hpp"

namespace plchost {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

TEST(DebugParts, AreTwoNumbers) {
  ASSERT_TRUE(DebugPart::parse("3 500"));
  EXPECT_EQ(DebugPart::parse("3 500")->session, 3U);
  EXPECT_EQ(DebugPart::parse("3 500")->offset, 500U);
  EXPECT_TRUE(DebugPart::parse("18446744073709551615 18446744073709551615"));
  for (const char* bad : {"", "3", "3 ", " 3 5", "3 5 ", "-1 5", "3 x", "18446744073709551616 0", "3  5"})
    EXPECT_FALSE(DebugPart::parse(bad)) << bad;
}

class DebugPageInParts : public ::testing::Test {
 protected:
  ~DebugPageInParts() override { DebugPage::remove(pool_, "line1"); }
  std::string read(std::uint64_t offset, std::uint64_t session = 1, std::size_t most = 20) {
    return read_debug_part(pool_, "line1", {.session = session, .offset = offset}, most).value_or("?");
  }

  /// At the time of the last read: a machine that stands still is no debugger that does not go on.
  [[nodiscard]] bool is_being_read() { return sut.is_being_read(sut.asked().when); }

  std::string pool_ = own_name("debug");
  DebugPage sut = DebugPage::create(pool_, "line1").value();
};

TEST_F(DebugPageInParts, TellsVersionSizeAndText) {
  sut.write("0123456789abcdefghijklmnopqrstuvwxyz");
  EXPECT_EQ(read(0), "1 36 0123456789abcde");
  EXPECT_EQ(read(15), "1 36 fghijklmnopqrst");
  EXPECT_EQ(read(30), "1 36 uvwxyz");
  EXPECT_EQ(read(36), "1 36 ");
  EXPECT_EQ(read(~std::uint64_t{0}), "1 36 ");
  sut.write("0123456789abcdefghijklmnopqrstuvwxyz");
  EXPECT_THAT(read(0), StartsWith("1 "));
  sut.write("x");
  EXPECT_EQ(read(0), "2 1 x");
  sut.write(std::string(kMaxDebugState, 'y'));
  EXPECT_THAT(read(kMaxDebugState - 1), HasSubstr(" y"));
  sut.write(std::string(kMaxDebugState + 1, 'z'));
  EXPECT_THAT(read(0), HasSubstr(" y")) << "it is too long: nothing is done";
}

TEST_F(DebugPageInParts, TellsWhoHasAsked) {
  sut.write("x");
  EXPECT_EQ(sut.asked().session, 0U);
  (void)read(0, 0);
  EXPECT_EQ(sut.asked().session, 0U) << "that one only looks";
  const TimePoint before = MonotonicClock::now();
  (void)read(0, 7);
  EXPECT_EQ(sut.asked().session, 7U);
  EXPECT_GE(sut.asked().when, before);
}

TEST_F(DebugPageInParts, IsHeldWhileTheOtherPartsAreRead) {
  sut.write("0123456789abcdefghijklmnopqrstuvwxyz");
  EXPECT_FALSE(sut.is_being_read(MonotonicClock::now()));
  (void)read(0);
  EXPECT_TRUE(is_being_read());
  (void)read(15);
  EXPECT_TRUE(is_being_read());
  (void)read(30);
  EXPECT_FALSE(is_being_read()) << "that was the last part";
}

TEST_F(DebugPageInParts, IsNotHeldForADebuggerThatDoesNotGoOn) {
  sut.write("0123456789abcdefghijklmnopqrstuvwxyz");
  (void)read(0);
  EXPECT_TRUE(is_being_read());
  EXPECT_FALSE(sut.is_being_read(sut.asked().when + std::chrono::milliseconds(101)));
}

TEST_F(DebugPageInParts, IsHeldForABoundedTime) {
  sut.write("0123456789abcdefghijklmnopqrstuvwxyz");
  const auto is_held = [&] {
    (void)read(0);
    return is_being_read();
  };
  EXPECT_TRUE(is_held());
  int asked = 0;  // by a debugger that begins again and again
  while (asked < 1'000'000 && is_held()) ++asked;
  EXPECT_FALSE(is_held());
  sut.write("zyxwvutsrqponmlkjihgfedcba9876543210");
  EXPECT_TRUE(is_held());
}

TEST_F(DebugPageInParts, OfAnInstanceWithoutADebugBuildIsNotThere) {
  const auto part = read_debug_part(pool_, "line2", {}, 500);
  ASSERT_FALSE(part);
  EXPECT_EQ(part.error().code, ErrorCode::not_found);
  EXPECT_THAT(part.error().message, HasSubstr("--debug"));
}

}  // namespace
}  // namespace plchost
