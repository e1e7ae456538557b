#include "instances/adapters/compiler_output.hpp"

#include <string>
#include <vector>

#include <gmock/gmock.h>

#include "tests/unit/adapters/problem_texts.hpp"

namespace plchost {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

std::vector<std::string> told(std::string_view output) {
  return texts(
      problems_of_compiler(output, [](const std::string& file, unsigned line) -> std::optional<FoundSource> {
        if (file == "POUS.h")
          return FoundSource{{"main.st", line, 3}, "variable 'grid'", "declare it in another way"};
        if (file != "/line/main.st") return std::nullopt;
        return FoundSource{{"main.st", line, 0}};
      }));
}

constexpr std::string_view kInHeader = R"(In file included from generated.hpp:3,
                 from plchost_R.cpp:2:
/strucpp/iec_var.hpp: In instantiation of 'class IECVar<Valve>':
/line/main.st:7:12:   required from here
/strucpp/iec_var.hpp:40:5: error: static assertion failed: no value
   40 |     static_assert(x);
)";

TEST(OutputOfACompiler, HasErrorsInTheSourcesOfTheUser) {
  EXPECT_THAT(
      told(
          "In file included from plchost_R.cpp:2:\n/line/main.st: In member function 'void MAIN::run()':\n"
          "/line/main.st:3:10: error: no match for 'operator+'\n    3 |   a := b + c;\n"
          "/line/main.st:3:10: error: no match for 'operator+'\n"
          "/line/main.st:5: fatal error: too much\n/line/main.st:6:1: warning: x\nother.cpp:1:1: error: y\n"),
      ElementsAre("main.st:3: no match for 'operator+'", "main.st:5: too much"));
}

TEST(OutputOfACompiler, HasThePlaceThatNeedsATemplateOrAMacro) {
  EXPECT_THAT(told(kInHeader), ElementsAre("main.st:7: static assertion failed: no value"));
  EXPECT_THAT(told("accessor.h:5:9: error: expected ')'\naccessor.h:6:1: note: in expansion of macro '__A'\n"
                   "/line/main.st:8:3: note: in expansion of macro '__SET_VAR'\n"
                   "/line/main.st:9:3: note: in expansion of macro '__SET_VAR'\n"),
              ElementsAre("main.st:8: expected ')'"));
}

TEST(OutputOfACompiler, HasTheNameOfADeclarationAndWhatToDo) {
  EXPECT_THAT(
      told("POUS.h:5:9: error: unknown type name 'GRID'\n"),
      ElementsAre("main.st:5:3: variable 'grid': unknown type name 'GRID'; declare it in another way"));
}

TEST(OutputOfACompiler, IsShownFromItsFirstErrorOn) {
  EXPECT_TRUE(from_first_error(kInHeader).starts_with("/strucpp/iec_var.hpp:40:5: error:"));
  EXPECT_EQ(from_first_error("cc: a wish\nfails"), "cc: a wish\nfails");
  EXPECT_THAT(told("error: 1\n:\n1:2:3\nx:99999999999999999999: error: y\n" + std::string(10'000, ':')),
              IsEmpty());
}

const std::vector<iec::Source> kSources{{"a.st",
                                         "PROGRAM p\n  {extern unsigned long __turn;\n   count = __turn;}\n "
                                         "(* __turn *) {{ x(); }}\nEND_PROGRAM"},
                                        {"b.st", "{ __turns = 1; }\n{ x(); }"}};

TEST(OutputOfTheLoader, NamesASymbolThatAPragmaUses) {
  const std::string output = "/tmp/line.so cannot be loaded: /tmp/line.so: undefined symbol: __turn\n";
  EXPECT_EQ(undefined_symbol(output), "__turn");
  EXPECT_EQ(undefined_symbol("other"), "");
  EXPECT_THAT(texts(pragmas_with(undefined_symbol(output), kSources)),
              ElementsAre("a.st:2:25: the C in this pragma uses __turn, which plchost does not have"));
  EXPECT_THAT(pragmas_with("", kSources), IsEmpty());
}

TEST(LineOfC, IsFoundInItsPragma) {
  EXPECT_EQ(place_in_pragma("   count = __turn;", kSources), (iec::SourcePlace{"a.st", 3, 0}));
  EXPECT_EQ(place_in_pragma("extern unsigned long __turn;", kSources), (iec::SourcePlace{"a.st", 2, 0}));
  EXPECT_EQ(place_in_pragma("x();", kSources), std::nullopt) << "in two pragmas";
  EXPECT_EQ(place_in_pragma("", kSources), std::nullopt);
}

}  // namespace
}  // namespace plchost
