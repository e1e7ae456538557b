#include "instances/adapters/matiec/initial_values.hpp"

#include <string>

#include <gtest/gtest.h>

namespace plchost::matiec {
namespace {

TEST(InitialValues, AreSetByFunctionsThatAreMarked) {
  EXPECT_EQ(
      with_marked_initial_values(
          "void MAIN_init__(MAIN *data__, BOOL retain) {\n  __INIT_VAR(data__->A,0,retain)\n}\n"
          "void config_init__(void) {\n  ONE_init__();\n}"),
      "PLCHOST_ONCE void MAIN_init__(MAIN *data__, BOOL retain) {\n  __INIT_VAR(data__->A,0,retain)\n}\n"
      "PLCHOST_ONCE void config_init__(void) {\n  ONE_init__();\n}");
}

TEST(InitialValues, AloneAreMarked) {
  for (const char* const code :
       {"void MAIN_body__(MAIN *data__) {\n}\n", "void ONE_init__(void);\n",
        "  MAIN_init__(&ONE__M,retain);\n", "void MAIN_body__(MAIN *data__) { X_init__(\n{", "void {\n", "",
        "\n\n", "void "}) {
    EXPECT_EQ(with_marked_initial_values(code), code);
  }
}

}  // namespace
}  // namespace plchost::matiec
