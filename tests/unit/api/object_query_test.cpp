#include "api/dds/object_query.hpp"

#include <gmock/gmock.h>

#include "api/dds/text.hpp"
#include "shm/base/names.hpp"

namespace plchost {
namespace {

using testing::AllOf;
using testing::HasSubstr;

plc_KeyValue entry(std::string_view name, std::string_view value) {
  plc_KeyValue made{};
  dds::copy_text(made.name, name);
  dds::copy_text(made.value, value);
  return made;
}

TEST(ObjectQuery, TravelsAsItIs) {
  const ObjectQuery sent{.name = {},
                         .type = ObjectType::mutex,
                         .match = "line?/F\u00fcll*",
                         .after = std::string(kMaxObjectName, 'a')};
  const auto got = parse_object_query(entries_of(sent).value()).value();
  EXPECT_EQ(got.type, sent.type);
  EXPECT_EQ(got.match, sent.match);
  EXPECT_EQ(got.after, sent.after);
  EXPECT_EQ(got.name, "");
  EXPECT_TRUE(entries_of(ObjectQuery{}).value().empty());
  EXPECT_EQ(parse_object_query(entries_of(ObjectQuery{.name = "line1/ready"}).value()).value().name,
            "line1/ready");
}

TEST(ObjectQuery, RefusesWhatCannotBe) {
  const auto error = [](std::vector<plc_KeyValue> entries) {
    const auto query = parse_object_query(entries);
    return query ? std::string("none") : query.error().message;
  };
  EXPECT_THAT(error({entry("type", "evnt")}),
              AllOf(HasSubstr("evnt"), HasSubstr("memory, semaphore, event, mutex")));
  EXPECT_THAT(error({entry("name", "a"), entry("type", "event")}), HasSubstr("either one object by name"));
  EXPECT_THAT(error({entry("match", "a"), entry("match", "b")}), HasSubstr("twice"));
  EXPECT_THAT(error({entry("match", std::string(kMaxObjectName + 1, 'a'))}), HasSubstr("96 bytes"));
  EXPECT_THAT(error({entry("match", "\xff")}), HasSubstr("UTF-8"));
  EXPECT_THAT(error({entry("name", "a\x1b[2J")}), testing::Not(HasSubstr("\x1b")));
  EXPECT_EQ(error({entry("later", "than this server")}), "none");
  EXPECT_EQ(entries_of(ObjectQuery{.name = std::string(kMaxObjectName + 1, 'a')}).error().code,
            ErrorCode::invalid_argument);
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
