// The state of a debugger in shared memory.
#include "shm/pages/debug_page.hpp"

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "shm/files/pool_files.hpp"
#include "tests/support/own_name.hpp"

namespace plchost {
namespace {

using ::testing::HasSubstr;

class DebugPageOfAnInstance : public ::testing::Test {
 protected:
  ~DebugPageOfAnInstance() override { DebugPage::remove(pool_, "line1"); }
  DebugPart read(std::uint64_t offset = 0, std::uint64_t session = 1) {
    return read_debug_part(pool_, "line1", {.session = session, .offset = offset}).value_or(DebugPart{});
  }

  std::string pool_ = own_name("debug");
  DebugPage sut = DebugPage::create(pool_, "line1").value();
};

TEST_F(DebugPageOfAnInstance, TellsTheStateFromAnOffsetOn) {
  sut.write("0123456789");
  const DebugPart whole = read();
  EXPECT_EQ(whole.text, "0123456789");
  EXPECT_EQ(whole.size, 10U);
  EXPECT_EQ(whole.offset, 0U);
  const DebugPart rest = read(7);
  EXPECT_EQ(rest.text, "789");
  EXPECT_EQ(rest.size, 10U);
  EXPECT_EQ(rest.offset, 7U);
  EXPECT_EQ(rest.version, whole.version);
  EXPECT_EQ(read(10).text, "");
  EXPECT_EQ(read(~std::uint64_t{0}).text, "");
}

TEST_F(DebugPageOfAnInstance, CountsTheVersionsOfTheState) {
  sut.write("x");
  const std::uint64_t first = read().version;
  sut.write("x");
  EXPECT_EQ(read().version, first);
  sut.write("y");
  EXPECT_EQ(read().version, first + 1);
}

TEST_F(DebugPageOfAnInstance, HasRoomForAStateOfABoundedSize) {
  sut.write(std::string(kMaxDebugState, 'y'));
  EXPECT_EQ(read().text, std::string(kMaxDebugState, 'y'));
  sut.write(std::string(kMaxDebugState + 1, 'z'));
  EXPECT_EQ(read().text, std::string(kMaxDebugState, 'y')) << "it is too long: nothing is done";
}

TEST_F(DebugPageOfAnInstance, ShowsNoControlCharactersOfAStranger) {
  sut.write("\x1b[2J {}");
  EXPECT_EQ(read(1).text, "[2J {}");
  EXPECT_EQ(read().text, "?[2J {}");
}

TEST_F(DebugPageOfAnInstance, TellsWhoHasAsked) {
  sut.write("x");
  EXPECT_EQ(sut.asked().session, 0U);
  (void)read(0, 0);
  EXPECT_EQ(sut.asked().session, 0U) << "that one only looks";
  const TimePoint before = MonotonicClock::now();
  (void)read(0, 7);
  EXPECT_EQ(sut.asked().session, 7U);
  EXPECT_GE(sut.asked().when, before);
}

TEST_F(DebugPageOfAnInstance, IsNotThereWithoutADebugBuild) {
  const auto part = read_debug_part(pool_, "line2", {});
  ASSERT_FALSE(part);
  EXPECT_EQ(part.error().code, ErrorCode::not_found);
  EXPECT_THAT(part.error().message, HasSubstr("--debug"));
}

}  // namespace
}  // namespace plchost
