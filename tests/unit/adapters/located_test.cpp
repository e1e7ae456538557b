#include "instances/adapters/matiec/located.hpp"

#include <utility>

#include <gmock/gmock.h>

#include "instances/adapters/iec/place.hpp"

namespace plchost::matiec {
namespace {

using iec::location_of;
using iec::Place;
using iec::place_of;
using iec::Widths;
using testing::HasSubstr;
using testing::SizeIs;

TEST(LocatedVariable, LiesWhereItsNumbersSay) {
  EXPECT_EQ(place_of("%IX0.1"), (Place{.area = 'I', .offset = 0, .bytes = 1, .bit = 1}));
  EXPECT_EQ(place_of("%qx3.7"), (Place{.area = 'Q', .offset = 3, .bytes = 1, .bit = 7}));
  EXPECT_EQ(place_of("%QX11"), (Place{.area = 'Q', .offset = 1, .bytes = 1, .bit = 3}));
  EXPECT_EQ(place_of("%M3"), (Place{.area = 'M', .offset = 0, .bytes = 1, .bit = 3}));
  EXPECT_EQ(place_of("%MB3"), (Place{.area = 'M', .offset = 3, .bytes = 1, .bit = -1}));
  EXPECT_EQ(place_of("%IW2"), (Place{.area = 'I', .offset = 4, .bytes = 2, .bit = -1}));
  EXPECT_EQ(place_of("%ID2"), (Place{.area = 'I', .offset = 8, .bytes = 4, .bit = -1}));
  EXPECT_EQ(place_of("%QL2"), (Place{.area = 'Q', .offset = 16, .bytes = 8, .bit = -1}));
}

TEST(LocatedVariable, SaysWhatIsAllowed) {
  for (const char* const wrong : {"", "%", "%I", "%IX", "%IX0.8", "%IX0.1.2", "%IW1.1", "%AW1", "%IW-1",
                                  "%IW*", "%IW99999999999", "IW1"}) {
    const auto result = place_of(wrong);
    ASSERT_FALSE(result) << wrong;
    EXPECT_THAT(result.error(), HasSubstr("allowed are %I, %Q or %M")) << wrong;
  }
}

TEST(LocatedVariable, OfOpenPlcLiesBehindThoseOfSmallerWidth) {
  const auto offset = [](const char* text) { return place_of(*location_of(text), Widths::separate)->offset; };
  EXPECT_EQ(offset("%QX0.7"), 0U);
  EXPECT_EQ(offset("%QX1023.7"), 1023U);
  EXPECT_EQ(offset("%QB0"), 1024U);
  EXPECT_EQ(offset("%QB1023"), 2047U);
  EXPECT_EQ(offset("%QW0"), 2048U);
  EXPECT_EQ(offset("%QW1023"), 4094U);
  EXPECT_EQ(offset("%QD0"), 4096U);
  EXPECT_EQ(offset("%QL0"), 8192U);
  EXPECT_EQ(offset("%QL1023"), 16376U);
  for (const char* const beyond : {"%QX1024.0", "%QB1024", "%QW1024", "%QD1024", "%QL1024"}) {
    const auto none = place_of(*location_of(beyond), Widths::separate);
    ASSERT_FALSE(none) << beyond;
    EXPECT_THAT(none.error(), HasSubstr("allowed are the numbers 0 to 1023 there"));
  }
  for (const Widths widths : {Widths::shared, Widths::separate}) {
    for (const char* const text : {"%IX3.5", "%QB7", "%MW1", "%ID1023", "%QL5"})
      EXPECT_EQ(location_of(*place_of(*location_of(text), widths), widths).text(), text);
  }
}

TEST(LocatedVariable, MayHaveSeveralNumbers) {
  EXPECT_EQ(location_of("%qw0.1.8192.0")->text(), "%QW0.1.8192.0");
  EXPECT_EQ(location_of("%I0.1.2")->text(), "%IX0.1.2");
  for (const auto& [text, is_hierarchical] :
       {std::pair{"%QX0.1", false}, std::pair{"%QX11", false}, std::pair{"%QX0.8", false},
        std::pair{"%QX0.1.2", true}, std::pair{"%QW1", false}, std::pair{"%QW0.1", true}}) {
    EXPECT_EQ(location_of(text)->is_hierarchical(), is_hierarchical) << text;
  }
  EXPECT_FALSE(location_of("%QW1..2"));
  EXPECT_FALSE(location_of("%QW1.2.3.4.5.6.7.8.9.10.11.12.13.14.15.16.17"));
  EXPECT_FALSE(location_of("%QW4294967296.0"));
}

TEST(LocatedVariable, IsReadFromTheFileOfTheCompilerWhoseEndIsNone) {
  const auto found =
      located_variables("__LOCATED_VAR(INT,__IW2,I,W,2)\nSTOP__LOCATED_VAR(BOOL,__QX0_1,Q,X,0,1)\nBOUND");
  ASSERT_THAT(found, SizeIs(2));
  EXPECT_EQ(found[0].type, "INT");
  EXPECT_EQ(found[0].location, "%IW2");
  EXPECT_EQ(found[1].name, "__QX0_1");
  EXPECT_EQ(found[1].location, "%QX0.1");
  EXPECT_EQ(located_variables("__LOCATED_VAR(INT,__QW0_1_8192_0,Q,W,0,1,8192,0)").at(0).location,
            "%QW0.1.8192.0");
  EXPECT_THAT(located_variables("__LOCATED_VAR(\n__LOCATED_VAR(a,b)\n)"), SizeIs(0));
}

}  // namespace
}  // namespace plchost::matiec
