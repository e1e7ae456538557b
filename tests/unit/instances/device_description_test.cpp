#include "instances/runtime/settings/device_description.hpp"

#include <string>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "instances/runtime/tasks/registered_events.hpp"

namespace plchost {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

constexpr std::string_view kSupported =
    R"(<ts:setting name="supportexternal" type="boolean"><ts:value>1</ts:value></ts:setting>)";

std::string device_with(std::string_view settings) {
  return fmt::format(
      "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n"
      "<DeviceDescription xmlns=\"http://www.3s-software.com/schemas/DeviceDescription-1.0.xsd\"\n"
      " xmlns:ts=\"http://www.3s-software.com/schemas/TargetSettings-0.1.xsd\">\n"
      "<Device><ExtendedSettings><ts:TargetSettings>\n"
      "<ts:section name=\"memory\"><ts:setting "
      "name=\"supportexternal\"><ts:value>7</ts:value></ts:setting></ts:section>\n"
      "<ts:section name=\"taskconfiguration\">\n{}\n</ts:section>\n"
      "</ts:TargetSettings></ExtendedSettings></Device></DeviceDescription>\n",
      settings);
}

std::string events_setting(std::string_view value) {
  return fmt::format(
      "{}\n<ts:setting name=\"externalevents\" type=\"cdata\" "
      "access=\"hide\"><ts:value>{}</ts:value></ts:setting>",
      kSupported, value);
}

std::string event(std::string_view name) {
  return fmt::format("<externalevent> <name>{}</name> </externalevent>", name);
}

Result<DeviceDescription> parse_xml(std::string_view text) {
  return parse_device_description(text, "d.xml");
}

std::string fault_of(std::string_view settings) {
  const auto parsed = parse_xml(device_with(settings));
  return parsed ? "" : parsed.error().message;
}

TEST(DeviceDescriptionFile, NamesItsEventsInACdataSectionAsTheSeedDoes) {
  const auto sut =
      parse_xml(device_with(events_setting("<![CDATA[\n<externalevents>\n" + event("myCyclicInterrupt") +
                                           event("\n  ready\n") + "</externalevents>\n]]>")));
  ASSERT_TRUE(sut) << sut.error().describe();
  EXPECT_TRUE(sut->supports_external);
  EXPECT_THAT(sut->events, ElementsAre("myCyclicInterrupt", "ready"));
}

TEST(DeviceDescriptionFile, NamesItsEventsAsElementsOrEscapedText) {
  EXPECT_THAT(
      parse_xml(device_with(events_setting("<externalevents>" + event("a") + "</externalevents>")))->events,
      ElementsAre("a"));
  EXPECT_THAT(parse_xml(device_with(events_setting("&lt;externalevents>&lt;externalevent>&lt;name>b&lt;/"
                                                   "name>&lt;/externalevent>&lt;/externalevents>")))
                  ->events,
              ElementsAre("b"));
}

TEST(DeviceDescriptionFile, WithoutItsSettingsSupportsNoExternalEvents) {
  for (const std::string& text : {device_with(""), std::string("<DeviceDescription/>"),
                                  std::string("<DeviceDescription><Device/></DeviceDescription>")}) {
    const auto sut = parse_xml(text);
    ASSERT_TRUE(sut) << sut.error().describe();
    EXPECT_FALSE(sut->supports_external);
    EXPECT_THAT(sut->events, IsEmpty());
  }
}

TEST(DeviceDescriptionFile, InOtherEncodingsIsRead) {
  const std::string text = device_with(events_setting("<externalevents>" + event("a") + "</externalevents>"));
  std::string utf16 = "\xff\xfe";
  for (const char c : text.substr(text.find('\n') + 1)) utf16 += {c, '\0'};
  const auto sut = parse_xml(utf16);
  ASSERT_TRUE(sut) << sut.error().describe();
  EXPECT_THAT(sut->events, ElementsAre("a"));
}

TEST(DeviceDescriptionFile, IsRefusedWithItsLineAndWhatIsAllowed) {
  const std::string twice = "<externalevents>" + event("a") + event("a") + "</externalevents>";
  EXPECT_THAT(fault_of(events_setting(twice)),
              ::testing::AllOf(StartsWith("d.xml:8: "), HasSubstr("'a' is there twice")));
  EXPECT_THAT(fault_of(events_setting("<externalevents>" + event("a b") + "</externalevents>")),
              HasSubstr("name"));
  EXPECT_THAT(fault_of(events_setting("<externalevents>" + event("") + "</externalevents>")),
              HasSubstr("name"));
  EXPECT_THAT(fault_of(events_setting("<externalevents><event/></externalevents>")),
              HasSubstr("externalevent is"));
  EXPECT_THAT(fault_of(events_setting("<externalevents><externalevent/></externalevents>")),
              HasSubstr("without a name"));
  EXPECT_THAT(fault_of(events_setting("<![CDATA[<externalevents>]]>")), HasSubstr("is no XML"));
  EXPECT_THAT(fault_of(events_setting("<![CDATA[<x/>]]>")), HasSubstr("has no <externalevents>"));
  EXPECT_THAT(fault_of(R"(<ts:setting name="supportexternal"><ts:value>yes</ts:value></ts:setting>)"),
              ::testing::AllOf(StartsWith("d.xml:7: "), HasSubstr("0 and 1 are")));
  EXPECT_THAT(parse_xml("<DeviceDescription>").error().message, StartsWith("d.xml:1: no XML"));
  EXPECT_THAT(parse_xml("").error().message, StartsWith("d.xml:1: no XML"));
  EXPECT_THAT(parse_xml("<html/>").error().message, HasSubstr("its root is not"));
}

TEST(DeviceDescriptionFile, OfAnEntityBombCostsNothingAndIsNoName) {
  std::string bomb = "<?xml version=\"1.0\"?><!DOCTYPE x [<!ENTITY a \"aaaaaaaaaa\">";
  for (char c = 'b'; c <= 'z'; ++c) {
    bomb += fmt::format("<!ENTITY {} \"", c);
    for (int i = 0; i < 10; ++i) bomb += fmt::format("&{};", static_cast<char>(c - 1));
    bomb += "\">";
  }
  bomb += "]>";
  const std::string text =
      device_with(events_setting("<externalevents>" + event("&z;") + "</externalevents>"));
  const auto sut = parse_xml(bomb + text.substr(text.find('\n') + 1));
  ASSERT_FALSE(sut);
  EXPECT_THAT(sut.error().message, HasSubstr("name"));
}

TEST(DeviceDescriptionFile, NestedAMillionDeepIsReadOrRefused) {
  std::string deep;
  for (int i = 0; i < 1'000'000; ++i) deep += "<a>";
  EXPECT_FALSE(parse_xml(deep));
  for (int i = 0; i < 1'000'000; ++i) deep += "</a>";
  EXPECT_FALSE(parse_xml(deep));
  EXPECT_THAT(fault_of(events_setting(deep)), HasSubstr("externalevents"));
}

TEST(DeviceDescriptionFile, HasBounds) {
  std::string many = "<externalevents>";
  for (std::size_t i = 0; i <= kMaxDeviceEvents; ++i) many += event(fmt::format("e{}", i));
  EXPECT_THAT(fault_of(events_setting(many + "</externalevents>")), HasSubstr("more than 1024 events"));
  EXPECT_THAT(parse_xml(std::string(kMaxDeviceDescription + 1, ' ')).error().message,
              HasSubstr("are allowed"));
}

TaskConfig waiting_for(const std::string& name) {
  TaskConfig task;
  task.name = "OnEvent";
  task.kind = TaskKind::external;
  task.external_event = name;
  return task;
}

TEST(DeviceEvents, ATaskThatWaitsForAnotherOneIsRefusedWithTheList) {
  const DeviceDescription device{.supports_external = true, .events = {"ready", "stop"}};
  const std::vector<TaskConfig> known{waiting_for("stop"), TaskConfig{}};
  EXPECT_TRUE(check_device_events(device, known));
  const std::vector<TaskConfig> unknown{waiting_for("start")};
  EXPECT_THAT(
      check_device_events(device, unknown).error().message,
      ::testing::AllOf(HasSubstr("'OnEvent'"), HasSubstr("'start'"), HasSubstr("it names: ready, stop")));
  EXPECT_THAT(check_device_events(DeviceDescription{}, known).error().message,
              HasSubstr("supportexternal is not 1"));
}

TEST(DeviceEvents, AreRegisteredAsLongAsTheProcessLives) {
  EventTable events("line1", nullptr);
  ASSERT_TRUE(register_device_events({.supports_external = true, .events = {"ready"}}, events));
  EXPECT_EQ(events.unregister_by_operator("ready").error().code, ErrorCode::refused);
  EXPECT_EQ(events.register_by_operator("ready").error().code, ErrorCode::already_exists);
  EXPECT_THAT(events.registered_by_operator(), IsEmpty());
  EXPECT_TRUE(events.register_by_application(events.open("ready").value()))
      << "an application may do so, too";
}

}  // namespace
}  // namespace plchost
