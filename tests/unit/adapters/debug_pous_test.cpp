#include "instances/adapters/iec/debug_pous.hpp"

#include <fstream>
#include <sstream>
#include <string>

#include <gmock/gmock.h>

namespace plchost::iec {
namespace {

using testing::HasSubstr;

TEST(DebugPous, AreDeclaredWithTheirInstances) {
  const std::vector<DebugPou> pous{{"Main", "a.st", {3, 2, 3}}, {"Counter", "a.st", {9}}};
  const std::vector<DebugInstance> instances{{.pou = 1, .value = "x.UP", .path = "Main0.up"}};
  EXPECT_THAT(debug_header(pous), HasSubstr("plchost_lines_0[] = {2u, 3u};\nstatic Plc_Pou plchost_pou_0 = "
                                            "{__builtin_offsetof(Plc_Pou, pArrays), \"Main\", \"a.st\", "
                                            "plchost_lines_0, 2u, 0u, 0, 0u, 0, 0u};"));
  const std::string text = debug_declarations(pous, instances);
  EXPECT_THAT(text, HasSubstr("plc_debug_declare_pou(&plchost_pou_1) == 0;\n"));
  EXPECT_THAT(text, HasSubstr("plc_debug_declare_instance(&plchost_pou_1, &x.UP, \"Main0.up\") == 0;\n"));
}

TEST(DebugPous, AreDeclaredWithTheirLocalVariables) {
  const std::vector<DebugPou> pous{{"Main", "a.st", {3}},
                                   {"Add",
                                    "a.st",
                                    {9},
                                    {{.name = "x", .type = "3u", .bytes = "0", .address = "&X"},
                                     {.name = "s",
                                      .type = "25u",
                                      .bytes = "sizeof(STRING)",
                                      .address = "&S",
                                      .first_line = 4,
                                      .last_line = 9}}}};
  EXPECT_EQ(debug_enter(1, "0", pous[1].locals, 7),
            "  void* const plchost_locals_[] = {&X, &S};\n"
            "  PLC_ENTER_LOCALS(plchost_pou_1, 0, plchost_locals_, 7u);\n");
  EXPECT_EQ(debug_enter(0, "this"), "  PLC_ENTER(plchost_pou_0, this);\n");
  const std::string text = debug_declarations(pous, {});
  EXPECT_THAT(text, HasSubstr("  static const Plc_Local plchost_locals_1[] = {\n"));
  EXPECT_THAT(text,
              HasSubstr("    {\"x\", 3u, 0, 0u, 0u},\n    {\"s\", 25u, sizeof(STRING), 4u, 9u},\n  };\n"));
  EXPECT_THAT(text, HasSubstr("  plchost_pou_1.pLocals = plchost_locals_1;\n  plchost_pou_1.nLocals = 2u;\n"
                              "  good = good && plc_debug_declare_pou(&plchost_pou_1) == 0;\n"));
  EXPECT_THAT(text, testing::Not(HasSubstr("plchost_locals_0")));
  EXPECT_THAT(text, testing::Not(HasSubstr("plchost_arrays_")));
  EXPECT_THAT(text, testing::Not(HasSubstr("dwSize"))) << "a runtime of before arrays takes them";
}

TEST(DebugPous, AreDeclaredWithTheDimensionsOfTheirLocalArrays) {
  DebugLocal grid{
      .name = "grid[][]",
      .type = "4u",
      .bytes = "0",
      .address = "&GRID.table[0][0]",
      .dimensions = {{.first = -1, .count = 2, .stride = ""}, {.first = 0, .count = 3, .stride = ""}}};
  give_strides(std::span(grid.dimensions), "sizeof(DINT)");
  const std::vector<DebugPou> pous{
      {"Add", "a.st", {9}, {{.name = "x", .type = "3u", .bytes = "0", .address = "&X"}, grid}}};
  EXPECT_THAT(debug_declarations(pous, {}),
              HasSubstr("  static const Plc_LocalArray plchost_arrays_0[] = {\n"
                        "    {1u, 2u, {{-1, 2u, 3u * sizeof(DINT)}, {0, 3u, 1u * sizeof(DINT)}}},\n  };\n"
                        "  plchost_pou_0.pArrays = plchost_arrays_0;\n  plchost_pou_0.nArrays = 1u;\n"
                        "  plchost_pou_0.dwSize = sizeof(Plc_Pou);\n"));
}

// A program may have them as names of its own.
TEST(DebugPous, LeaveNoMacroOfTheHeadersBehind) {
  const std::string header = debug_header({});
  for (const char* const name :
       {"plc_app.h", "plc_instance.h", "plc_variables.h", "plc_online_change.h", "plc_debug.h"}) {
    std::ifstream file(std::string(EXAMPLES) + "/../" + name);
    ASSERT_TRUE(file) << name;
    for (std::string line; std::getline(file, line);) {
      std::istringstream words(line);
      std::string define;
      std::string macro;
      words >> define >> macro;
      if (define != "#define" || macro.starts_with("PLC_")) continue;
      EXPECT_THAT(header, HasSubstr("#undef " + macro + "\n"));
    }
  }
}

}  // namespace
}  // namespace plchost::iec
