// How forced variables are shown, in tables.
#include "api/cli/rows/variable_rows.hpp"

#include <gtest/gtest.h>

#include "api/dds/text.hpp"

namespace plchost {
namespace {

plc_VariableRecord record(std::string_view name, std::string_view value, bool forced = false,
                          std::string_view forced_value = "") {
  plc_VariableRecord made{};
  dds::copy_text(made.name, name);
  dds::copy_text(made.value, value);
  made.forced = forced;
  dds::copy_text(made.forced_value, forced_value);
  return made;
}

TEST(ForcedVariables, AreMarkedInTheirColumnAlsoIfOnlyElementsAre) {
  std::vector<Row> rows;
  for (const auto& one :
       {record("a", "7", true, "7"), record("b", "8"), record("t[]", "[1, 2]", true), record("u[]", "[3]")})
    rows.push_back(to_row(one, VariableOwner{"cell", "line1"}));
  mark_forced_arrays(rows);
  EXPECT_EQ(format_table(
                rows, {{.field = "name", .header = "NAME"}, {.field = "forced_value", .header = "FORCED"}}),
            "NAME  FORCED\n"
            "a     7\n"
            "b     -\n"
            "t[]   elements\n"
            "u[]   -\n");
}

TEST(ForcedVariables, AreToldBesideAValue) {
  EXPECT_EQ(forced_text(record("a", "7", true, "7")), "forced");
  EXPECT_EQ(forced_text(record("t[]", "[1, 2]", true)), "elements forced");
  EXPECT_EQ(forced_text(record("b", "8")), "");
}

}  // namespace
}  // namespace plchost
