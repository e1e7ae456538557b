#include "api/dds/object_query.hpp"

#include <gmock/gmock.h>

#include "api/dds/text.hpp"
#include "shm/base/names.hpp"

namespace plchost {
namespace {

using testing::AllOf;
using testing::AnyOf;
using testing::HasSubstr;

TEST(ObjectQuery, TravelsAsItIs) {
  const ObjectQuery sent{.name = {},
                         .type = ObjectType::mutex,
                         .match = "line?/F\u00fcll*",
                         .after = std::string(kMaxObjectName, 'a')};
  const auto got = object_query_of(part_of(sent).value()).value();
  EXPECT_EQ(got.type, sent.type);
  EXPECT_EQ(got.match, sent.match);
  EXPECT_EQ(got.after, sent.after);
  EXPECT_EQ(got.name, "");
  EXPECT_FALSE(object_query_of(plc_ListPart{}).value().type) << "all";
  EXPECT_EQ(object_query_of(part_of(ObjectQuery{.name = "line1/ready"}).value()).value().name, "line1/ready");
}

TEST(ObjectQuery, RefusesWhatCannotBe) {
  const auto error = [](auto change) {
    plc_ListPart part{};
    change(part);
    const auto query = object_query_of(part);
    return query ? std::string("none") : query.error().message;
  };
  EXPECT_THAT(error([](plc_ListPart& part) { dds::copy_text(part.type, "evnt"); }),
              AllOf(HasSubstr("evnt"), HasSubstr("memory, semaphore, event, mutex")));
  EXPECT_THAT(error([](plc_ListPart& part) {
                dds::copy_text(part.name, "a");
                dds::copy_text(part.type, "event");
              }),
              HasSubstr("either one object by name"));
  EXPECT_THAT(error([](plc_ListPart& part) { dds::copy_text(part.match, "\xff"); }), HasSubstr("UTF-8"));
  EXPECT_THAT(error([](plc_ListPart& part) { dds::copy_text(part.name, "a\x1b[2J"); }),
              testing::Not(AnyOf(HasSubstr("\x1b"), testing::Eq("none"))));
  const std::string long_name(kMaxObjectName + 1, 'a');
  EXPECT_THAT(part_of(ObjectQuery{.match = long_name}).error().message, HasSubstr("96 bytes"));
  EXPECT_EQ(part_of(ObjectQuery{.name = long_name}).error().code, ErrorCode::invalid_argument);
}

TEST(MatchesPattern, TakesStarsAndQuestionMarks) {
  for (const char* pattern :
       {"line1/ready", "*", "line1/*", "*ready", "l*1*y", "line?/ready", "**", "line1/ready*"}) {
    EXPECT_TRUE(matches_pattern(pattern, "line1/ready")) << pattern;
  }
  for (const char* pattern : {"", "line1", "line1/read", "?line1/ready", "line2/*", "*x*", "line1/ready?"}) {
    EXPECT_FALSE(matches_pattern(pattern, "line1/ready")) << pattern;
  }
  EXPECT_TRUE(matches_pattern("a*b*c", "aXbXbXc")) << "a star takes more when the rest did not fit";
}

TEST(MatchesPattern, TakesACharacterOfUtf8AsOne) {
  EXPECT_TRUE(matches_pattern("F?ll", "F\u00fcll"));
  EXPECT_FALSE(matches_pattern("F??ll", "F\u00fcll"));
}

TEST(MatchesPattern, EndsSoonOverWhatIsMadeToTakeLong) {
  std::string pattern;
  for (std::size_t i = 0; i + 2 <= kMaxObjectName; i += 2) pattern += "*a";
  const std::string name = std::string(kMaxObjectName - 1, 'a') + "b";
  for (int i = 0; i < 1000; ++i) EXPECT_FALSE(matches_pattern(pattern, name));  // exponential: never
}

}  // namespace
}  // namespace plchost
