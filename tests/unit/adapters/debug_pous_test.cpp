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
  EXPECT_THAT(debug_header(pous),
              HasSubstr("plchost_lines_0[] = {2u, 3u};\nstatic Plc_Pou plchost_pou_0 = "
                        "{sizeof(Plc_Pou), \"Main\", \"a.st\", plchost_lines_0, 2u, 0u};"));
  const std::string text = debug_declarations(pous, instances);
  EXPECT_THAT(text, HasSubstr("plc_debug_declare_pou(&plchost_pou_1) == 0;\n"));
  EXPECT_THAT(text, HasSubstr("plc_debug_declare_instance(&plchost_pou_1, &x.UP, \"Main0.up\") == 0;\n"));
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
