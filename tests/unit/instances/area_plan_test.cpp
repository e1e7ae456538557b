// Where the areas of an application go, and what the settings about them may say.
#include "instances/runtime/memory/area_plan.hpp"

#include <string>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "instances/runtime/settings/read_settings.hpp"

namespace plchost {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

DeclaredArea declared(const std::string& name, std::uint32_t flags, std::uint32_t bytes) {
  return {.name = name,
          .flags = flags,
          .bytes = bytes,
          .layout = 0,
          .uses = {},
          .initial = std::vector<std::byte>(bytes),
          .address = nullptr};
}

std::vector<AreaSettings> areas_of(const std::string& text) {
  const auto settings = parse_settings("[SysMem]\n" + text, "l.cfg");
  EXPECT_TRUE(settings) << settings.error().message;
  return settings ? settings->areas : std::vector<AreaSettings>();
}

std::string error_of(const std::string& text) {
  const auto settings = parse_settings("[SysMem]\n" + text, "l.cfg");
  EXPECT_FALSE(settings);
  return settings ? "" : settings.error().message;
}

TEST(AreaFlags, OfTheUserAreMatchedByThemselvesAndPassOthersBy) {
  EXPECT_TRUE(flags_match(PLC_AREA_DATA | 0x8000, 0x8000));
  EXPECT_FALSE(flags_match(PLC_AREA_DATA | 0x8000, 0x0EFF)) << "as the seed says";
  EXPECT_TRUE(flags_match(PLC_AREA_DATA | 0x8000, 0xFEFF)) << "which is why the seed warns of it";
  EXPECT_FALSE(flags_match(0xC000, 0x8000));
}

TEST(AreaFlags, OfAnAreaWithoutTheUsersMustAllBeThere) {
  EXPECT_TRUE(flags_match(PLC_AREA_INPUT, 0x0EFF));
  EXPECT_FALSE(flags_match(PLC_AREA_INPUT, PLC_AREA_OUTPUT | PLC_AREA_DATA));
  EXPECT_FALSE(flags_match(PLC_AREA_RETAIN | PLC_AREA_PERSISTENT, PLC_AREA_RETAIN));
  EXPECT_FALSE(flags_match(PLC_AREA_DATA, 0x8000));
}

TEST(AreaPlan, TakesTheFirstThatMatchesFromTopDown) {
  const auto settings = areas_of(
      "Linux.Area.0.Flags=0x4\nLinux.Area.0.Object=in\nLinux.Area.0.Size=64\n"
      "Linux.Area.1.Flags=0x0EFF\nLinux.Area.1.Object=most\nLinux.Area.1.Size=64\n"
      "Linux.Area.2.Flags=0x8000\nLinux.Area.2.Object=mine\nLinux.Area.2.Size=64\n");
  const std::vector areas{declared("mine", PLC_AREA_DATA | 0x8000, 8), declared("input", PLC_AREA_INPUT, 8),
                          declared("data", PLC_AREA_DATA, 8), declared("other", PLC_AREA_USER, 8)};
  const auto sut = plan_areas(areas, settings);
  ASSERT_TRUE(sut) << sut.error().message;
  std::vector<std::string> objects;
  for (const auto& place : sut->places) {
    const AreaSettings* const one = sut->blocks[place.block].settings;
    objects.push_back(one == nullptr ? "" : one->object);
  }
  EXPECT_THAT(objects, ElementsAre("mine", "in", "most", ""));
}

TEST(AreaPlan, PutsAreasOfOneBlockOneBehindTheOther) {
  const auto settings = areas_of("Linux.Area.0.Flags=0x1\nLinux.Area.0.Object=d\nLinux.Area.0.Size=32\n");
  const std::vector areas{declared("a", PLC_AREA_DATA, 9), declared("b", PLC_AREA_DATA, 8),
                          declared("c", PLC_AREA_DATA, 8)};
  const auto sut = plan_areas(areas, settings);
  ASSERT_TRUE(sut) << sut.error().message;
  EXPECT_EQ(sut->places[0].offset, 0U);
  EXPECT_EQ(sut->places[1].offset, 16U);
  EXPECT_EQ(sut->places[2].offset, 24U);
}

TEST(AreaPlan, RefusesWhatDoesNotFitWithTheLineOfItsArea) {
  const auto settings = areas_of("Linux.Area.0.Flags=0x1\nLinux.Area.0.Object=d\nLinux.Area.0.Size=32\n");
  const std::vector areas{declared("a", PLC_AREA_DATA, 25), declared("b", PLC_AREA_DATA, 1)};
  const auto sut = plan_areas(areas, settings);
  ASSERT_FALSE(sut);
  EXPECT_THAT(sut.error().message,
              HasSubstr("l.cfg:2: [SysMem] Area.0: area 'b' of the application has 1 bytes, 0 "
                        "of the 32 are left"));
}

TEST(AreaPlan, RefusesInputsAndOutputsInOneObject) {
  const auto settings = areas_of("Linux.Area.0.Flags=0xC\nLinux.Area.0.Object=d\nLinux.Area.0.Size=32\n");
  const std::vector areas{declared("in", PLC_AREA_INPUT, 8), declared("out", PLC_AREA_OUTPUT, 8)};
  EXPECT_THAT(plan_areas(areas, settings).error().message, HasSubstr("cannot lie in one Object with 'in'"));
}

TEST(AreaPlan, KeepsRetainAreasTogetherAndOthersByThemselves) {
  const std::vector areas{declared("a", PLC_AREA_RETAIN, 9), declared("b", PLC_AREA_DATA, 8),
                          declared("c", PLC_AREA_PERSISTENT, 8), declared("d", PLC_AREA_OUTPUT, 8)};
  const auto sut = plan_areas(areas, {});
  ASSERT_TRUE(sut);
  EXPECT_EQ(sut->blocks.size(), 3U);
  EXPECT_EQ(sut->places[0].block, sut->places[2].block);
  EXPECT_EQ(sut->places[2].offset, 16U);
}

TEST(AreaSettings, OfTheSeedAreTaken) {
  const auto areas = areas_of(
      "VxWorks.Area.0.Flags=0x8000\nVxWorks.Area.0.Address=0x60540010\nVxWorks.Area.0.Size=0x10000\n");
  ASSERT_EQ(areas.size(), 1U);
  EXPECT_EQ(areas[0].flags, 0x8000U);
  EXPECT_EQ(areas[0].address, 0x60540010U);
  EXPECT_EQ(areas[0].size, 0x10000U);
  EXPECT_EQ(areas[0].device, "/dev/mem");
  EXPECT_EQ(areas[0].where, "l.cfg:2");
}

struct Bad {
  const char* text;
  const char* message;
};

class BadAreaSettings : public ::testing::TestWithParam<Bad> {};

TEST_P(BadAreaSettings, AreRefusedWithTheirLine) {
  EXPECT_THAT(error_of(GetParam().text), HasSubstr(GetParam().message));
}

INSTANTIATE_TEST_SUITE_P(
    Each, BadAreaSettings,
    ::testing::Values(
        Bad{"Linux.Area.0.Flags=0\n",
            "l.cfg:2: [SysMem] Linux.Area.0.Flags: '0' is not allowed; allowed is: 1 to 0xFFFF"},
        Bad{"Linux.Area.0.Flags=0x10000\n", "l.cfg:2: "},
        Bad{"Linux.Area.0.Address=0x60540011\n", "'0x60540011' is not allowed; allowed is: a multiple of 8"},
        Bad{"Linux.Area.0.Address=-8\n", "l.cfg:2: "},
        Bad{"\nLinux.Area.0.Size=0\n", "l.cfg:3: [SysMem] Linux.Area.0.Size: '0' is not allowed"},
        Bad{"Linux.Area.0.Size=0x40000001\n", "allowed is: bytes, 1 to 0x40000000"},
        Bad{"Linux.Area.0.Object=a/b\n", "name of a shared memory"},
        Bad{"Linux.Area.64.Size=1\n",
            "has no key 'Linux.Area.64.Size', did you mean 'Linux.Area.N.Size (N 0 to 63)'?"},
        Bad{"Area.0.Size=1\n", "has no key 'Area.0.Size'"}, Bad{"Linux.Area.0.Sise=1\n", "did you mean"},
        Bad{"Linux.Area.0.Flags=1\nLinux.Area.0.Size=8\n", "l.cfg:2: [SysMem] Area.0: needs an Address"},
        Bad{"Linux.Area.0.Flags=1\nLinux.Area.0.Object=a\n",
            "l.cfg:2: [SysMem] Area.0: needs Flags and Size"},
        Bad{"Linux.Area.0.Flags=1\nLinux.Area.0.Size=8\nLinux.Area.0.Object=a\nLinux.Area.0.Device=/dev/"
            "uio0\n",
            "l.cfg:2: [SysMem] Area.0: has both Device and Object"},
        Bad{"Linux.Area.0.Flags=1\nLinux.Area.0.Size=8\nLinux.Area.0.Object=a\nLinux.Area.0.Address=0\n",
            "l.cfg:2: [SysMem] Area.0: has an Address, which a shared memory"},
        Bad{"Linux.Area.1.Flags=1\nLinux.Area.1.Size=8\nLinux.Area.1.Object=a\n",
            "l.cfg:2: [SysMem] Area.1: there is no Area.0; areas are numbered"},
        Bad{"Linux.Area.0.Flags=1\nLinux.Area.0.Size=16\nLinux.Area.0.Address=0\n"
            "Linux.Area.1.Flags=2\nLinux.Area.1.Size=8\nLinux.Area.1.Address=8\n",
            "l.cfg:5: [SysMem] Area.1: overlaps with Area.0 of l.cfg:2"},
        Bad{"Linux.Area.0.Flags=1\nLinux.Area.0.Size=16\nLinux.Area.0.Object=a\n"
            "Linux.Area.1.Flags=2\nLinux.Area.1.Size=8\nLinux.Area.1.Object=a\n",
            "l.cfg:5: [SysMem] Area.1: overlaps with Area.0 of l.cfg:2"}));

TEST(AreaSettings, ThatOnlyTouchDoNotOverlap) {
  EXPECT_EQ(areas_of("Linux.Area.0.Flags=1\nLinux.Area.0.Size=16\nLinux.Area.0.Address=0\n"
                     "Linux.Area.1.Flags=2\nLinux.Area.1.Size=8\nLinux.Area.1.Address=16\n")
                .size(),
            2U);
}

TEST(RetainSettings, HaveTheirRanges) {
  const auto settings = parse_settings("[Retain]\nDirectory=/a\nIntervalMs=10\nMismatch=refuse\n", "l.cfg");
  ASSERT_TRUE(settings) << settings.error().message;
  EXPECT_EQ(settings->retain, (RetainSettings{.directory = "/a",
                                              .interval = std::chrono::milliseconds(10),
                                              .mismatch = RetainMismatch::refuse}));
  EXPECT_FALSE(parse_settings("[Retain]\nIntervalMs=9\n", "l.cfg"));
  EXPECT_THAT(
      parse_settings("[Retain]\nMismatch=Maybe\n", "l.cfg").error().message,
      HasSubstr(
          "l.cfg:2: [Retain] Mismatch: 'Maybe' is not allowed; allowed is: Initialise, Refuse, Ignore"));
}

struct BadDeclaration {
  const char* what;
  void (*spoil)(Plc_Area&);
};

class BadDeclarations : public ::testing::TestWithParam<BadDeclaration> {};

TEST_P(BadDeclarations, AreRefusedInWords) {
  Plc_Area area{};
  area.dwSize = sizeof area;
  area.dwFlags = PLC_AREA_OUTPUT;
  area.pszName = "a";
  area.dwBytes = 8;
  ASSERT_TRUE(from_declaration(area));
  GetParam().spoil(area);
  const auto sut = from_declaration(area);
  ASSERT_FALSE(sut);
  EXPECT_THAT(sut.error().message, HasSubstr(GetParam().what));
}

Plc_Area_Use beyond_the_end{"Main", 4, 5, nullptr};

INSTANTIATE_TEST_SUITE_P(
    Each, BadDeclarations,
    ::testing::Values(
        BadDeclaration{"dwSize is 1", [](Plc_Area& area) { area.dwSize = 1; }},
        BadDeclaration{"area", [](Plc_Area& area) { area.pszName = nullptr; }},
        BadDeclaration{"area", [](Plc_Area& area) { area.pszName = "a b"; }},
        BadDeclaration{"dwFlags 0x0", [](Plc_Area& area) { area.dwFlags = 0; }},
        BadDeclaration{"dwFlags 0x80", [](Plc_Area& area) { area.dwFlags = 0x80; }},
        BadDeclaration{"not both", [](Plc_Area& area) { area.dwFlags = PLC_AREA_INPUT | PLC_AREA_OUTPUT; }},
        BadDeclaration{"have no retain values", [](Plc_Area& area) { area.dwFlags |= PLC_AREA_RETAIN; }},
        BadDeclaration{"dwBytes 0", [](Plc_Area& area) { area.dwBytes = 0; }},
        BadDeclaration{"1 to 1048576", [](Plc_Area& area) { area.dwBytes = PLC_MAX_IMAGE + 1; }},
        BadDeclaration{"pUses must point", [](Plc_Area& area) { area.nUses = 1; }},
        BadDeclaration{"task 'Main': bytes 4 to 9 are not in it, it has 8", [](Plc_Area& area) {
                         area.nUses = 1;
                         area.pUses = &beyond_the_end;
                       }}));

TEST(DeclaredArea, UsesOfTasksThatWriteTheSameBytesAreRefused) {
  std::vector<DeclaredArea> areas{declared("out", PLC_AREA_OUTPUT, 8)};
  areas[0].uses = {{.task = "A", .offset = 0, .bytes = 5}, {.task = "B", .offset = 4, .bytes = 4}};
  const std::vector<std::string> tasks{"A", "B"};
  EXPECT_THAT(complete_uses(areas, tasks).error().message,
              HasSubstr("tasks 'A' and 'B' write the same bytes"));
  areas[0].uses[1].task = "C";
  EXPECT_THAT(complete_uses(areas, tasks).error().message, HasSubstr("no task 'C'; its tasks are A, B"));
}

TEST(DeclaredArea, IsUsedByAllTasksUnlessSaidOtherwiseUpToABound) {
  std::vector<std::string> tasks;
  for (int i = 0; i < PLC_MAX_AREA_USES; ++i) tasks.push_back(fmt::format("T{}", i));
  std::vector<DeclaredArea> areas{declared("out", PLC_AREA_OUTPUT, 8), declared("data", PLC_AREA_DATA, 8)};
  ASSERT_TRUE(complete_uses(areas, tasks));
  EXPECT_EQ(areas[0].uses.size(), tasks.size());
  tasks.emplace_back("more");
  areas[0].uses.clear();
  EXPECT_THAT(complete_uses(areas, tasks).error().message, HasSubstr("15 tasks use it; at most 14 can"));
}

}  // namespace
}  // namespace plchost
