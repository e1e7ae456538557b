#include "api/server/instance_extension.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "api/cli/rows.hpp"
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

TEST(InstanceExtension, IsShownByTheCliWhateverItsNames) {
  std::vector<plc_KeyValue> entries(2);
  dds::copy_text(entries[0].name, "of_a_newer_host");
  dds::copy_text(entries[0].value, "42");
  dds::copy_text(entries[1].name, "name");
  dds::copy_text(entries[1].value, "a forged one");
  const Row row = to_row(status_with(entries));
  EXPECT_EQ(row["of_a_newer_host"], "42");
  EXPECT_EQ(row["name"], "line1") << "an entry must not hide a field";
  EXPECT_THAT(format_fields(row), testing::HasSubstr("of_a_newer_host"));
}

}  // namespace
}  // namespace plchost
