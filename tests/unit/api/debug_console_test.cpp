// The commands of "plcctl debug".
#include "api/cli/debug/debug_console.hpp"

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/api/debugged_instance.hpp"

namespace plchost {
namespace {

using nlohmann::json;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

class DebugConsoleTest : public testing::Test {
 protected:
  DebugConsoleTest() {
    (void)link_.attach(false);
    instance_.variables = {variable_record("n", "INT", "7"), variable_record("Main.n", "INT", "1"),
                           variable_record("Main.c.n", "INT", "2"),
                           variable_record("Main.t[]", "ARRAY [1..2] OF INT", "[3, 4]")};
    instance_.halt("fast", 1, stack_);
  }

  std::string said(std::string_view line) {
    testing::internal::CaptureStdout();
    testing::internal::CaptureStderr();
    EXPECT_TRUE(sut_.obey(line));
    const std::string errors = testing::internal::GetCapturedStderr();
    return testing::internal::GetCapturedStdout() + errors;
  }

  const json stack_ =
      json::array({{{"pou", "Counter"}, {"line", 9}, {"file", "a.st"}, {"instance", "Main.c"}},
                   {{"pou", "Twice"}, {"line", 3}, {"file", "a.st"}},
                   {{"pou", "Main"}, {"line", 20}, {"file", "a.st"}, {"instance", "Main"}}});
  DebuggedInstance instance_;
  DebugLink link_{instance_.requests(), "cell", "line1"};
  DebugConsole sut_{link_};
};

TEST_F(DebugConsoleTest, PrintSaysWhatIsForced) {
  (void)said("tasks");
  instance_.force_all();
  EXPECT_EQ(said("print n"), "Main.c.n = 2  forced\n");
  EXPECT_EQ(said("print Main.t[]"), "Main.t[] = [3, 4]  elements forced\n");
}

}  // namespace
}  // namespace plchost
