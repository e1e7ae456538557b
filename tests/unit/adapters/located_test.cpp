#include "instances/adapters/matiec/located.hpp"

#include <gmock/gmock.h>

#include "instances/adapters/iec/place.hpp"

namespace plchost::matiec {
namespace {

using iec::Place;
using iec::place_of;
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

TEST(LocatedVariable, IsReadFromTheFileOfTheCompilerWhoseEndIsNone) {
  const auto found =
      located_variables("__LOCATED_VAR(INT,__IW2,I,W,2)\nSTOP__LOCATED_VAR(BOOL,__QX0_1,Q,X,0,1)\nBOUND");
  ASSERT_THAT(found, SizeIs(2));
  EXPECT_EQ(found[0].type, "INT");
  EXPECT_EQ(found[0].location, "%IW2");
  EXPECT_EQ(found[1].name, "__QX0_1");
  EXPECT_EQ(found[1].location, "%QX0.1");
  EXPECT_THAT(located_variables("__LOCATED_VAR(\n__LOCATED_VAR(a,b)\n)"), SizeIs(0));
}

}  // namespace
}  // namespace plchost::matiec
