#include "api/server/status/instance_extension.hpp"

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

TEST(InstanceExtension, CarriesWhatTheInstanceSaysAndNothingThatIsEmpty) {
  InstanceRuntime runtime;
  EXPECT_TRUE(extension_of(runtime).empty());
  runtime.tick_source.assign("System");
  runtime.tick_fallback.assign("open /dev/rtc7: No such file");
  runtime.idle_states.assign("held for core 1");
  const auto entries = extension_of(runtime);
  ASSERT_EQ(entries.size(), 3U);
  EXPECT_EQ(dds::text_of(entries[2].name), "idle_states");
  EXPECT_EQ(dds::text_of(entries[0].name), "tick_source");
  EXPECT_EQ(dds::text_of(entries[0].value), "System");
  EXPECT_EQ(dds::text_of(entries[1].name), "tick_fallback");
}

TEST(InstanceExtension, ItsProblemsAreThoseThatTheManagerAndThisProcessKnow) {
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

TEST(InstanceExtension, TellsOfTheDistributedClockOnceThereIsOne) {
  InstanceRuntime runtime;
  runtime.clock.reference.assign("bus1");
  EXPECT_EQ(extension_of(runtime).size(), 1U);
  runtime.clock.state = 3;
  runtime.clock.in_sync = 1;
  runtime.clock.offset_ns = -151;
  runtime.clock.drift_ppb = 99'960;
  const auto entries = extension_of(runtime);
  const auto value = [&](std::string_view name) {
    for (const auto& entry : entries) {
      if (dds::text_of(entry.name) == name) return std::string(dds::text_of(entry.value));
    }
    return std::string("none");
  };
  EXPECT_EQ(value("clock_reference"), "bus1");
  EXPECT_EQ(value("clock_state"), "locked");
  EXPECT_EQ(value("clock_in_sync"), "1");
  EXPECT_EQ(value("clock_offset_ns"), "-200");
  EXPECT_EQ(value("clock_drift_ppb"), "100000");
  EXPECT_EQ(value("clock_rejected_pairs"), "0, 0 not valid, 0 steps followed");
  EXPECT_EQ(value("clock_problem"), "none");
  runtime.clock.state = 77;
  EXPECT_EQ(extension_of(runtime).size(), 1U) << "a stranger's page";
  runtime.clock.problem.assign("no record");
  EXPECT_EQ(dds::text_of(extension_of(runtime)[1].value), "no record");
}

TEST(InstanceExtension, TellsHowManyTransitionsThereWere) {
  EXPECT_EQ(dds::text_of(transitions_entry(0).name), "transitions");
  EXPECT_EQ(dds::text_of(transitions_entry(0).value), "0");
  EXPECT_EQ(dds::text_of(transitions_entry(18'446'744'073'709'551'615U).value), "18446744073709551615");
}

TEST(InstanceExtension, IsShownByTheCliWhateverItsNames) {
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
