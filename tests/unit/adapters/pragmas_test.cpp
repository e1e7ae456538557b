#include "instances/adapters/iec/pragmas.hpp"

#include <string>
#include <vector>

#include <gmock/gmock.h>

#include "instances/adapters/matiec/joined_source.hpp"
#include "instances/adapters/strucpp/source_text.hpp"
#include "tests/unit/adapters/problem_texts.hpp"

namespace plchost::iec {
namespace {

using testing::ElementsAre;

TEST(PragmasOfOtherTools, AreToldIfAProgramMayRelyOnThem) {
  const std::vector<Source> sources{
      {"a.st",
       "{attribute 'location' := '16#8000'}\nVAR {Attribute 'hide'} a : INT; {attribute 'hide'} END_VAR\n"
       "{region 'x'} {text 'y'} {x := 1;} {{ error(); }}"},
      {"b.st", " {warning 'not ready'} {attribute 'hide'}\n{error 'to\ndo'}"}};
  EXPECT_THAT(texts(idle_pragmas(sources)),
              ElementsAre("a.st:1:1: {attribute 'location' := '16#8000'} has no effect",
                          "a.st:2:5: {Attribute 'hide'} has no effect",
                          "a.st:2:33: {attribute 'hide'} has no effect, here and in 1 other place",
                          "b.st:1:2: {warning 'not ready'} has no effect",
                          "b.st:2:1: {error 'to?do'} has no effect"));
}

TEST(PragmasOfOtherTools, AreNotSeenByTheCompilers) {
  const std::string pragma = "{attribute 'x'}";
  const auto program = [](const std::string& first, const std::string& place, const std::string& end) {
    return "PROGRAM P VAR " + first + " a" + place + " : BOOL;" + end + " b : INT; END_VAR {a\n:= 1;}\n";
  };
  const Source source{"a.st", program(pragma, " AT %QX0.0", "")};
  const std::string blank(pragma.size(), ' ');
  EXPECT_EQ(matiec::JoinedSource(std::vector<Source>{source}).text(),
            program(blank, " AT %QX0.0", " END_VAR VAR"));
  const auto made = strucpp::text_for_strucpp(source, {}, {});
  EXPECT_EQ(made.text, program(blank, "          ", ""));
  ASSERT_EQ(made.places.size(), 1U);
  EXPECT_EQ(made.places.front().name, "A");
}

}  // namespace
}  // namespace plchost::iec
