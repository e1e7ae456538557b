#include "instances/adapters/iec/c_texts.hpp"

#include <gtest/gtest.h>

namespace plchost::iec {
namespace {

TEST(EndedEscapes, AreThoseBeforeAHexadecimalDigit) {
  EXPECT_EQ(with_ended_escapes(R"(a = "Alarm\x0A1"; b = "\x41\x0aBc \x0Ag\x41";)"),
            R"(a = "Alarm\x0A""1"; b = "\x41\x0a""Bc \x0Ag\x41";)");
  EXPECT_EQ(with_ended_escapes(R"(w = u"\x0041BC";)"), R"(w = u"\x0041""BC";)");
}

TEST(EndedEscapes, AreNoneOfCommentsAndBackslashes) {
  for (const char* code : {R"("\\x0A1")", R"("a\"b\\x0A1")", "// \"\\x0A1\"\n/* '\"\\x0A1 */ x",
                           "'\"' + \\x0A1", "\"open\n\\x0A1", "/*", "\"\\", "\"\\x0"})
    EXPECT_EQ(with_ended_escapes(code), code);
}

TEST(EndedEscapes, MayBeOnlyThoseOfAMacro) {
  EXPECT_EQ(with_ended_escapes(R"(f("\x0A1"); M(7,"\x0A1"); M(,"x"))", "M("),
            R"(f("\x0A1"); M(7,"\x0A""1"); M(,"x"))");
}

}  // namespace
}  // namespace plchost::iec
