// A debug build of Structured Text, by way of MATIEC, where it is.
#include <cstdlib>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "instances/adapters/run_program.hpp"
#include "tests/integration/instances/debugged_process.hpp"

namespace plchost::testing {
namespace {

constexpr const char* kPress = R"(FUNCTION Twice : INT
  VAR_INPUT x : INT; END_VAR
  Twice := x * 2;
END_FUNCTION

FUNCTION_BLOCK Counter
  VAR_INPUT up : BOOL; END_VAR
  VAR_OUTPUT n : INT; END_VAR
  IF up THEN
    n := n + 1;
  END_IF;
END_FUNCTION_BLOCK

PROGRAM Press
  VAR one : Counter; two : Counter; total : INT; END_VAR
  one(up := TRUE);
  two(up := one.n > 5);
  IF total > 1000 THEN
    total := 0;
  ELSE
    total := Twice(two.n);
  END_IF;
END_PROGRAM

CONFIGURATION cell
  RESOURCE line ON PLC
    TASK fast (INTERVAL := T#10ms, PRIORITY := 1);
    PROGRAM press1 WITH fast : Press;
  END_RESOURCE
END_CONFIGURATION
)";

TEST_F(Debugging, OfStructuredTextIsDoneByItsLines) {
  if (std::getenv("PLCHOST_MATIEC") == nullptr)  // NOLINT(concurrency-mt-unsafe)
    GTEST_SKIP() << "needs MATIEC (PLCHOST_MATIEC)";
  const std::string program = sandbox_.folder() + "/press.so";
  const ProgramEnd built = run_program({PLCCTL, "build", "application", sandbox_.write("press.st", kPress),
                                        "-o", program, "--compiler", "matiec", "--debug"},
                                       sandbox_.folder())
                               .value();
  ASSERT_EQ(built.exit_code, 0) << built.output;
  start(program);
  attach();
  command("break Press:16");
  ASSERT_TRUE(halts("fast")) << state().dump(2);
  EXPECT_EQ(stack("fast"), "Press:16");
  EXPECT_EQ(process_->ask(ControlVerb::write_variable, "press1.one.n=100").code, ErrorCode::ok);
  EXPECT_EQ(process_->ask(ControlVerb::write_variable, "press1.two.n=200").code, ErrorCode::ok);
  command("delete *");
  const auto made = command("break press.st:8 if n > 150");
  EXPECT_EQ(made.value("pou", ""), "Counter");
  EXPECT_EQ(made.value("line", 0), 9);
  command("continue fast");
  // The names of a function block are those of the instance that comes there.
  EXPECT_TRUE(eventually([&] { return stack("fast") == "Counter:9 Press:17"; })) << state().dump(2);
  EXPECT_EQ(task("fast")["stack"][0].value("instance", ""), "press1.two");
  EXPECT_EQ(values_->read("press1.one.n"), "101");
  command("delete *");
  command("until fast Twice:3");
  EXPECT_TRUE(eventually([&] { return stack("fast") == "Twice:3 Press:21"; })) << state().dump(2);
  command("detach");
  EXPECT_TRUE(goes_on("fast"));
}

}  // namespace
}  // namespace plchost::testing
