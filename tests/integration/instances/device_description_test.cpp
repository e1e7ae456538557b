// The events of a device description, and an application that waits for another one.
#include <csignal>
#include <cstdlib>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/integration/instances/instance_process.hpp"

namespace plchost::testing {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

/// Settings beside a device description with these events.
std::string settings_with(const Sandbox& sandbox, const std::string& events) {
  (void)sandbox.write("device.xml",
                      "<DeviceDescription xmlns:ts='t'><Device><ExtendedSettings><ts:TargetSettings>"
                      "<ts:section name='taskconfiguration'>"
                      "<ts:setting name='supportexternal'><ts:value>1</ts:value></ts:setting>"
                      "<ts:setting name='externalevents' type='cdata'><ts:value><![CDATA[<externalevents>" +
                          events +
                          "</externalevents>]]></ts:value></ts:setting></ts:section></ts:TargetSettings>"
                          "</ExtendedSettings></Device></DeviceDescription>");
  return sandbox.write("line1.cfg", "[CmpSchedule]\nExternalEvent.DeviceDescription=device.xml\n");
}

TEST(DeviceDescriptionOfAnInstance, RegistersItsEventsWithoutAnApplication) {
  const Sandbox sandbox;
  InstanceProcess sut(
      sandbox, {"--settings", settings_with(sandbox, "<externalevent><name>spare</name></externalevent>")});
  EXPECT_TRUE(eventually([&] { return sut.event("spare").registered(); }));
  EXPECT_EQ(sut.ask(ControlVerb::unregister_event, "spare").code, ErrorCode::refused);
  EXPECT_EQ(sut.end(SIGTERM), EXIT_SUCCESS);
}

TEST(DeviceDescriptionOfAnInstance, KeepsAnApplicationOutThatWaitsForAnotherEvent) {
  const Sandbox sandbox;
  InstanceProcess sut(
      sandbox, {"--settings", settings_with(sandbox, "<externalevent><name>spare</name></externalevent>"),
                "--application", application("all_kinds")});
  EXPECT_EQ(sut.end(), 3);
  EXPECT_THAT(sut.log(), AllOf(HasSubstr("load application failed"), HasSubstr("it names: spare")));
}

TEST(DeviceDescriptionOfAnInstance, ThatCannotBeReadIsNamedWithItsLine) {
  const Sandbox sandbox;
  InstanceProcess sut(sandbox, {"--settings", settings_with(sandbox, "<externalevent/>")});
  EXPECT_EQ(sut.end(), 3);
  EXPECT_THAT(sut.log(), HasSubstr("device.xml:1: externalevents: an externalevent without a name"));
}

}  // namespace
}  // namespace plchost::testing
