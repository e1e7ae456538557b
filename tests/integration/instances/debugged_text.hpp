#pragma once

#include <cstdlib>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include "instances/adapters/run_program.hpp"
#include "shm/variables/variable_symbol.hpp"
#include "tests/integration/instances/debugged_process.hpp"

namespace plchost::testing {

/// A debug build of Structured Text, by the compiler of that name.
class DebuggedText : public Debugging, public ::testing::WithParamInterface<std::string> {
 protected:
  void SetUp() override {
    const char* const variable = GetParam() == "matiec" ? "PLCHOST_MATIEC" : "PLCHOST_STRUCPP";
    const char* const folder = std::getenv(variable);  // NOLINT(concurrency-mt-unsafe)
    if (folder == nullptr || *folder == '\0') GTEST_SKIP() << "needs " << variable;
  }
  /// The messages of the build.
  std::string build(const std::string& text, const std::string& program, const std::string& file) const {
    const ProgramEnd built = run_program({PLCCTL, "build", "application", sandbox_.write(file, text), "-o",
                                          program, "--compiler", GetParam(), "--debug"},
                                         sandbox_.folder())
                                 .value();
    EXPECT_EQ(built.exit_code, 0) << built.output;
    return built.output;
  }
  void build_and_attach(const std::string& text, const std::string& file = "press.st") {
    const std::string program = sandbox_.folder() + "/press.so";
    (void)build(text, program, file);
    ASSERT_FALSE(HasFailure());
    start(program);
    attach();
  }
  void write(const std::string& text) {
    const ControlReply reply = process_->ask(ControlVerb::write_variable, text);
    EXPECT_EQ(reply.code, ErrorCode::ok) << reply.text;
  }
  bool comes_to(const std::string& place) {
    return eventually([&] { return stack("Main") == place; });
  }
  /// The value of a local variable of a call; "none": it has none of this name.
  std::string local(std::size_t frame, const std::string& name) {
    const json found = task("Main")["stack"][frame];
    for (const json& one : found.value("locals", json::array())) {
      if (!same_variable_name(one.value("name", ""), name)) continue;
      if (!one.contains("elements")) return one.value("value", "");
      return fmt::format("[{}]", fmt::join(one["elements"].get<std::vector<std::string>>(), ", "));
    }
    return "none";
  }
  std::string innermost() { return task("Main")["stack"][0].value("instance", ""); }
};

}  // namespace plchost::testing
