#include "api/server/status/host_grid.hpp"

#include <cstdint>

#include <gtest/gtest.h>

#include "api/dds/text.hpp"

namespace plchost {
namespace {

enum State : std::uint32_t { off = 0, free_running = 1, acquiring = 2, locked = 3, hold_over = 4 };

ClockRuntime clock_with(State state, std::int64_t offset_ns, const char* reference) {
  ClockRuntime clock;
  clock.state = state;
  clock.in_sync = state == locked ? 1 : 0;
  clock.offset_ns = offset_ns;
  clock.reference.assign(reference);
  return clock;
}

plc_HostStatus put(const HostGrid& grid) {
  plc_HostStatus status{};
  grid.put(status);
  return status;
}

TEST(HostGrid, IsNoneWhereNoInstanceFollowsAClock) {
  HostGrid sut;
  sut.add(clock_with(off, 7'000, ""));
  const plc_HostStatus status = put(sut);
  EXPECT_EQ(status.grid_instances, 0U);
  EXPECT_EQ(status.grid_in_sync, 0U);
  EXPECT_EQ(status.grid_offset_ns, 0);
  EXPECT_EQ(dds::text_of(status.grid_reference), "");
}

TEST(HostGrid, IsThatOfTheInstanceThatIsFurthestOff) {
  HostGrid sut;
  sut.add(clock_with(locked, 900, "tai"));
  sut.add(clock_with(locked, -41'260, "ptp:/dev/ptp0"));
  sut.add(clock_with(acquiring, 2'000, "bus1"));
  const plc_HostStatus status = put(sut);
  EXPECT_EQ(status.grid_instances, 3U);
  EXPECT_EQ(status.grid_in_sync, 2U);
  EXPECT_EQ(status.grid_offset_ns, -41'300);
  EXPECT_EQ(dds::text_of(status.grid_reference), "ptp:/dev/ptp0");
}

TEST(HostGrid, AnInstanceWithoutItsClockIsNotInSyncAndHasNoOffset) {
  HostGrid sut;
  sut.add(clock_with(free_running, 900'000, "bus1"));
  EXPECT_EQ(dds::text_of(put(sut).grid_reference), "bus1");
  EXPECT_EQ(put(sut).grid_measured, 0U);
  sut.add(clock_with(locked, 0, "tai"));
  const plc_HostStatus status = put(sut);
  EXPECT_EQ(status.grid_instances, 2U);
  EXPECT_EQ(status.grid_in_sync, 1U);
  EXPECT_EQ(status.grid_measured, 1U);
  EXPECT_EQ(status.grid_offset_ns, 0);
  EXPECT_EQ(dds::text_of(status.grid_reference), "tai");
}

TEST(HostGrid, LeavesOutStatesThatThereAreNot) {
  HostGrid sut;
  ClockRuntime clock = clock_with(locked, 1, "tai");
  clock.state = 6;
  sut.add(clock);
  EXPECT_EQ(put(sut).grid_instances, 0U);
}

}  // namespace
}  // namespace plchost
