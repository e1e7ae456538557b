#include "api/server/status/instance_runtime.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "api/cli/rows/status_rows.hpp"
#include "api/dds/text.hpp"

namespace plchost {
namespace {

plc_InstanceStatus status_with(std::vector<plc_KeyValue>& entries) {
  plc_InstanceStatus status{};
  dds::copy_text(status.instance, "line1");
  status.ext._length = status.ext._maximum = static_cast<std::uint32_t>(entries.size());
  status.ext._buffer = entries.data();
  return status;
}

TEST(InstanceRuntimeStatus, CarriesWhatTheInstanceSays) {
  InstanceRuntime runtime;
  plc_InstanceStatus status{};
  put_runtime(runtime, status);
  EXPECT_EQ(to_row(status), to_row(plc_InstanceStatus{})) << "a feature that is not in use";
  runtime.tick_source.assign("System");
  runtime.tick_fallback.assign("cannot open /dev/rtc7: No such file");
  runtime.idle_states.assign("held for core 1");
  put_runtime(runtime, status);
  const Row row = to_row(status);
  EXPECT_EQ(row["tick_source"], "System");
  EXPECT_EQ(row["tick_fallback"], "cannot open /dev/rtc7: No such file");
  EXPECT_EQ(row["idle_states"], "held for core 1");
}

TEST(InstanceRuntimeStatus, ItsProblemsAreThoseThatTheManagerAndThisProcessKnow) {
  InstanceStatus status;
  status.pid = 7;
  EXPECT_EQ(problem_of_instance(status, nullptr), "");
  InstanceRuntime runtime;
  runtime.pid = 7;
  EXPECT_EQ(problem_of_instance(status, &runtime), "");
  runtime.retain_problem.assign("not written");
  EXPECT_EQ(problem_of_instance(status, &runtime), "not written");
  status.problem.assign("safe mode");
  EXPECT_EQ(problem_of_instance(status, &runtime), "safe mode; not written");
  status.pid = 0;
  EXPECT_EQ(problem_of_instance(status, &runtime), "safe mode") << "that process has ended";
}

TEST(InstanceRuntimeStatus, TellsOfTheDistributedClockOnceThereIsOne) {
  InstanceRuntime runtime;
  const auto row = [&] {
    plc_InstanceStatus status{};
    put_runtime(runtime, status);
    return to_row(status);
  };
  runtime.clock.reference.assign("bus1");
  EXPECT_EQ(row()["clock_reference"], "bus1");
  EXPECT_EQ(row()["clock_state"], "off");
  EXPECT_EQ(row()["clock_in_sync"], false);
  runtime.clock.state = 3;
  runtime.clock.in_sync = 1;
  runtime.clock.offset_ns = -151;
  runtime.clock.drift_ppb = 99'960;
  runtime.clock.rejected = 7;
  EXPECT_EQ(row()["clock_state"], "locked");
  EXPECT_EQ(row()["clock_in_sync"], true);
  EXPECT_EQ(row()["clock_offset_us"], -0.2);
  EXPECT_EQ(row()["clock_drift_ppb"], 100'000);
  EXPECT_EQ(row()["clock_rejected_pairs"], 7);
  EXPECT_EQ(row()["clock_problem"], "");
  runtime.clock.state = 77;
  EXPECT_EQ(row()["clock_state"], "off") << "a stranger's page";
  runtime.clock.problem.assign("no record");
  EXPECT_EQ(row()["clock_problem"], "no record");
}

TEST(InstanceRuntimeStatus, IsShownByTheCliWhateverItsNames) {
  std::vector<plc_KeyValue> entries(2);
  dds::copy_text(entries[0].name, "of_a_newer_host");
  dds::copy_text(entries[0].value, "42");
  dds::copy_text(entries[1].name, "name");
  dds::copy_text(entries[1].value, "a forged one");
  const Row row = to_row(status_with(entries));
  EXPECT_EQ(row["of_a_newer_host"], 42);
  EXPECT_EQ(row["name"], "line1") << "an entry must not hide a field";
  EXPECT_THAT(format_fields(row), testing::HasSubstr("of_a_newer_host"));
}

}  // namespace
}  // namespace plchost
