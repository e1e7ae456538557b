// C++ in the form of STruC++ 0.6.2, and the macros that a debug build puts into it.
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>

#include "instances/adapters/strucpp/instances.hpp"
#include "instances/adapters/strucpp/statements.hpp"

namespace plchost::strucpp {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using Section = iec::Variable::Section;

iec::Pou pou_named(iec::Pou::Kind kind, const std::string& name, const std::string& file,
                   std::vector<iec::Variable> variables = {}) {
  return {.kind = kind,
          .name = name,
          .variables = std::move(variables),
          .chart = "",
          .place = {.file = file, .line = 1, .column = 1}};
}
iec::Variable declared(const std::string& name, const std::string& type, const std::string& member,
                       Section section = Section::local) {
  return {.name = name, .type = type, .location = "", .section = section, .place = {}, .member = member};
}

iec::Project example() {
  using Kind = iec::Pou::Kind;
  iec::Project made;
  made.add(pou_named(Kind::program, "Main", "main.st",
                     {declared("up", "COUNTER", "UP"), declared("kind", "COUNTER", "KIND_"),
                      declared("line.m1", "COUNTER", "LINE[-1]"),
                      declared("grid.0.12", "COUNTER", "GRID(0, 12)"), declared("late", "TON", "LATE"),
                      declared("n", "INT", "N"), declared("other", "COUNTER", "OTHER", Section::in_out),
                      declared("link", "REFERENCE COUNTER", "LINK"), declared("tmp", "COUNTER", "")}));
  made.add(pou_named(Kind::function_block, "Counter", "blocks.st", {declared("inner", "PART", "INNER")}));
  made.add(pou_named(Kind::function_block, "Part", "blocks.st"));
  made.add(pou_named(Kind::function, "Twice", "b \"1\".st"));
  made.add(pou_named(Kind::function_block, "TON", ""));
  return made;
}

DebugCode made_of(std::vector<std::string> codes) {
  return with_statements(codes, example(), CppValues("", {}));
}

constexpr const char* kMain = R"(namespace strucpp {

Program_MAIN::Program_MAIN()
    : I(0)
{
}

void Program_MAIN::run() {
#line 4 "/x/main.st"
    UP.INC = 1;
    UP();
#line 5 "/x/main.st"
    for (I = 0; I <= 9; I++) {
#line 6 "/x/main.st"
        if (I == 8) {
#line 6 "/x/main.st"
            goto __strucpp_loop_exit_0;
#line 6 "/x/main.st"
        } else if (I > 3) {
#line 7 "/x/main.st"
            K = 1;
#line 8 "/x/main.st"
        } else {
#line 9 "/x/main.st"
            return;
#line 10 "/x/main.st"
        }
#line 11 "/x/main.st"
    }
    __strucpp_loop_exit_0: ;
#line 12 "/x/main.st"
    do {
#line 13 "/x/main.st"
        J = J - 1;
#line 14 "/x/main.st"
    } while (!(J <= 0));
#line 15 "/x/main.st"
    while (J < 3) {
#line 16 "/x/main.st"
    }
#line 17 "/x/main.st"
    switch (K) {
#line 18 "/x/main.st"
        case 0:
        case 1:
#line 18 "/x/main.st"
            K = 2;
            break;
        default:
#line 20 "/x/main.st"
            K = 3;
            break;
#line 21 "/x/main.st"
    }
#line 22 "/x/main.st"
}

}  // namespace strucpp)";

TEST(StrucppStatements, OfEachKindGetTheirMacros) {
  const DebugCode made = made_of({kMain});
  ASSERT_EQ(made.pous.size(), 1U);
  EXPECT_EQ(made.pous[0].name, "Main");
  EXPECT_EQ(made.pous[0].file, "main.st");
  EXPECT_THAT(made.pous[0].lines, ElementsAre(4, 5, 6, 6, 7, 9, 12, 13, 15, 17, 18, 20));
  const std::string& text = made.texts.at(0);
  EXPECT_THAT(text, HasSubstr("void Program_MAIN::run() {\n  PLC_ENTER(plchost_pou_0, this);\n"
                              "PLC_STATEMENT(4u);\n#line 4 \"/x/main.st\"\n    UP.INC = 1;\n    UP();\n"));
  EXPECT_THAT(text, HasSubstr("PLC_STATEMENT(6u);\n#line 6 \"/x/main.st\"\n            goto "));
  EXPECT_THAT(text,
              HasSubstr("        case 1:\nPLC_STATEMENT(18u);\n#line 18 \"/x/main.st\"\n            K"));
  EXPECT_THAT(text, HasSubstr("        default:\nPLC_STATEMENT(20u);\n"));
  EXPECT_THAT(text, HasSubstr("    : I(0)\n{\n}\n"));
}

// Without the macros it is what it was: all lines of the source are where they were, too.
TEST(StrucppStatements, LeaveAllElseAsItWas) {
  std::string text = made_of({kMain}).texts.at(0);
  for (const char* const macro : {"PLC_STATEMENT(", "  PLC_ENTER("}) {
    for (std::size_t at = text.find(macro); at != std::string::npos; at = text.find(macro))
      text.erase(at, text.find('\n', at) + 1 - at);
  }
  EXPECT_EQ(text, std::string(kMain) + "\n");
}

// Each line names the file of the first source, whichever one it is of.
TEST(StrucppStatements, OfMethodsAreThoseOfTheirBlock) {
  const DebugCode made = made_of({R"(#line 1 "/x/main.st"
void COUNTER::operator()() {
#line 9 "/x/main.st"
    N = N + 1;
#line 10 "/x/main.st"
}

#line 3 "/x/main.st"
IEC_INT COUNTER::RESET(IEC_INT TO) {
    IEC_INT RESET_result;
#line 5 "/x/main.st"
    N = TO;
    return RESET_result;
#line 6 "/x/main.st"
}

IEC_INT COUNTER::get_SIZE() const {
    IEC_INT SIZE_result;
#line 7 "/x/main.st"
    SIZE_result = N;
    return SIZE_result;
}
)",
                                  R"(#line 2 "/x/main.st"
Array1D<IEC_INT, 1, 3> TWICE(IEC_INT X, IEC_INT& Y) {
    Array1D<IEC_INT, 1, 3> TWICE_result;
    IEC_INT I;
#line 4 "/x/main.st"
    Y = X;
    return TWICE_result;
}
)"});
  ASSERT_EQ(made.pous.size(), 2U);
  EXPECT_EQ(made.pous[0].name, "Counter");
  EXPECT_EQ(made.pous[0].file, "blocks.st");
  EXPECT_THAT(made.pous[0].lines, ElementsAre(9, 5, 7));
  EXPECT_EQ(made.pous[1].file, "b \"1\".st");
  EXPECT_THAT(made.texts[0], HasSubstr("operator()() {\n  PLC_ENTER(plchost_pou_0, this);\n"));
  EXPECT_THAT(
      made.texts[0],
      HasSubstr("  PLC_ENTER_LOCALS(plchost_pou_0, this, plchost_locals_, 0u);\nPLC_STATEMENT(5u);\n"));
  EXPECT_THAT(
      made.texts[0],
      HasSubstr("  PLC_ENTER_LOCALS(plchost_pou_0, this, plchost_locals_, 2u);\nPLC_STATEMENT(7u);\n"));
  EXPECT_THAT(made.texts[1],
              HasSubstr("  PLC_ENTER_LOCALS(plchost_pou_1, 0, plchost_locals_, 0u);\nPLC_STATEMENT(4u);\n"));
  EXPECT_THAT(iec::debug_header(made.pous), HasSubstr("plchost_lines_0[] = {5u, 7u, 9u};"));
}

constexpr const char* kHeader = R"(namespace strucpp {
enum class COLOR { RED, GREEN };

using IEC_COLOR = IEC_ENUM<COLOR>;

using SMALL = INT_t;
constexpr INT_t SMALL_MIN = 0;

struct PNT {
    IEC_INT XX{};
    IEC_COLOR INK{};
};

using IEC_PNT = PNT;

using ARR = Array1D<IEC_INT, 1, 3>;

class COUNTER {
public:
    // Local variables
    IEC_INT N;
    IEC_WORD TMP_;
    COUNTER();
    virtual IEC_INT RESET(IEC_INT TO, IEC_LREAL& BY);
};
}  // namespace strucpp
)";

/// "NAME TYPE BYTES ADDRESS LINES" of each.
std::vector<std::string> shown(const std::vector<iec::DebugLocal>& locals) {
  std::vector<std::string> all;
  for (const iec::DebugLocal& one : locals) {
    all.push_back(fmt::format("{} {} {} {} {}-{}", one.name, one.type, one.bytes, one.address, one.first_line,
                              one.last_line));
    for (const auto& [first, count, stride] : one.dimensions)
      all.back() += fmt::format(" {}+{} {}", first, count, stride);
  }
  return all;
}

TEST(StrucppLocals, AreThoseOfFunctionsAndMethods) {
  iec::Project project = example();
  project.pous[1].variables.push_back(declared("Tmp", "WORD", "TMP_", Section::temporary));
  const std::vector<iec::Source> sources{{"a.st", "Twice Ink small xx tmp"}};
  const std::vector<std::string> codes{
      R"(void COUNTER::operator()() {
#line 9 "x"
    N = N + 1;
#line 11 "x"
    N = N + 1;
}

IEC_INT COUNTER::RESET(IEC_INT TO, IEC_LREAL& BY) {
    IEC_INT RESET_result;
#line 5 "x"
    N = TO;
    return RESET_result;
}

IEC_INT COUNTER::get_SIZE() const {
#line 7 "x"
    N = 2;
}
)",
      R"(IEC_INT TWICE(const IEC_STRING& TEXT, Array1D<IEC_INT, 1, 3> X, IEC_TIME& T) {
    IEC_INT TWICE_result;
    IEC_COLOR C = COLOR::RED;
    PNT PP;
    ARR A;
    Array2D<PNT, 0, 1, 2, 4> P2;
    Array1D<Array1D<IECStringVar<10>, 0, 4>, -1, 1> AA;
    Array1D<IEC_ENUM<COLOR>, 1, 2> CC;
    Array1D<IEC_INT, 1, 99999999> HUGE;
    SMALL SMALL_ = 3;
    IECStringVar<10> S = "(=";
    IECStringVar<9000> LONG;
    IECWStringVar<2040> WS;
    IEC_WSTRING WW;
    IECWStringVar<2041> WIDE;
    IEC_INT* P;
    COUNTER BLOCK;
#line 4 "x"
    IEC_REAL __output_tmp_0;
    for (I = 0; I <= 9; I++) {
#line 5 "x"
        X = 1;
    }
}
)"};
  const DebugCode made = with_statements(codes, project, CppValues(kHeader, sources));
  ASSERT_EQ(made.pous.size(), 2U);
  EXPECT_THAT(
      shown(made.pous[0].locals),
      ElementsAre("Tmp 11u 0 ::plchost_local(TMP_) 9-11", "TO 3u 0 ::plchost_local(TO) 5-5",
                  "BY 15u 0 ::plchost_local(BY) 5-5", "RESET 3u 0 ::plchost_local(RESET_result) 5-5"));
  EXPECT_THAT(
      shown(made.pous[1].locals),
      ElementsAre("TEXT 26u plchost_bytes<strucpp::IEC_STRING> ::plchost_local(TEXT) 0-0",
                  "X[] 3u 0 ::plchost_local(::plchost_at(X, 1L)) 0-0 1+3 1u * sizeof(strucpp::IEC_INT)",
                  "T 16u 0 ::plchost_local(T) 0-0", "Twice 3u 0 ::plchost_local(TWICE_result) 0-0",
                  "C plchost_enumeration<strucpp::COLOR> 0 ::plchost_local(C) 0-0",
                  "PP.xx 3u 0 ::plchost_local(PP.XX) 0-0",
                  "PP.Ink plchost_enumeration<strucpp::COLOR> 0 ::plchost_local(PP.INK) 0-0",
                  "A[] 3u 0 ::plchost_local(::plchost_at(A, 1L)) 0-0 1+3 1u * sizeof(strucpp::IEC_INT)",
                  "P2[][].xx 3u 0 ::plchost_local(::plchost_at(P2, 0L, 2L).XX) 0-0 0+2 3u * "
                  "sizeof(strucpp::PNT) 2+3 1u * sizeof(strucpp::PNT)",
                  "P2[][].Ink plchost_enumeration<strucpp::COLOR> 0 "
                  "::plchost_local(::plchost_at(P2, 0L, 2L).INK) 0-0 0+2 3u * sizeof(strucpp::PNT) 2+3 "
                  "1u * sizeof(strucpp::PNT)",
                  "AA[][] 26u plchost_bytes<strucpp::IECStringVar<10>> "
                  "::plchost_local(::plchost_at(::plchost_at(AA, -1L), 0L)) 0-0 -1+3 1u * 5u * 1u * "
                  "sizeof(strucpp::IECStringVar<10>) 0+5 1u * sizeof(strucpp::IECStringVar<10>)",
                  "CC[] plchost_enumeration<strucpp::COLOR> 0 ::plchost_local(::plchost_at(CC, 1L)) 0-0 "
                  "1+2 1u * sizeof(strucpp::IEC_ENUM<strucpp::COLOR>)",
                  "small 3u 0 ::plchost_local(SMALL_) 0-0",
                  "S 26u plchost_bytes<strucpp::IECStringVar<10>> ::plchost_local(S) 0-0",
                  "WS 31u plchost_bytes<strucpp::IECWStringVar<2040>> ::plchost_local(WS) 0-0",
                  "WW 31u plchost_bytes<strucpp::IEC_WSTRING> ::plchost_local(WW) 0-0"));
  EXPECT_THAT(made.texts[0],
              HasSubstr("RESET_result;\n  void* const plchost_locals_[] = {::plchost_local(TO), "
                        "::plchost_local(BY), ::plchost_local(RESET_result)};\n"
                        "  PLC_ENTER_LOCALS(plchost_pou_0, this, plchost_locals_, 1u);\n"
                        "PLC_STATEMENT(5u);\n#line 5"));
  EXPECT_THAT(made.texts[0], HasSubstr("get_SIZE() const {\n  PLC_ENTER(plchost_pou_0, this);\n"));
}

constexpr const char* kLibrary = R"(void TON::operator()() {
#line 3 "x"
    Q = true;
}
void OTHER::operator()() {
#line 4 "x"
    Q = true;
}
void PART::operator()() {
    // Empty function block body
#line 9 "x"
}
#line 8 "x"
    Q = true;
#line 5)";

TEST(StrucppStatements, OfLibrariesStayAsTheyAre) {
  const DebugCode made = made_of({kLibrary});
  EXPECT_THAT(made.pous, IsEmpty());
  EXPECT_EQ(made.texts.at(0), std::string(kLibrary) + "\n");
}

/// "POU VALUE PATH" of each, if these are symbols.
std::vector<std::string> instances(const std::vector<std::string>& names) {
  const iec::Project read = example();
  const iec::Program program{
      .name = "Main0", .type = "MAIN", .task = "", .place = {}, .copies_globals = false, .extension = {}};
  iec::TaskPlan plan;
  plan.tasks.emplace_back().programs = {&program};
  std::vector<Symbol> symbols;
  for (const std::string& name : names) symbols.emplace_back().name = name;
  const std::vector<iec::DebugPou> pous{{"Main", "", {1}}, {"Part", "", {1}}, {"Counter", "", {1}}};
  std::vector<std::string> found;
  for (const iec::DebugInstance& one : instances_of(read, plan, symbols, pous))
    found.push_back(pous[one.pou].name + " " + one.value + " " + one.path);
  return found;
}

TEST(StrucppInstances, HaveThePathsOfTheirVariables) {
  EXPECT_THAT(instances({}), ElementsAre("Main g_config.MAIN0 Main0", "Counter g_config.MAIN0.UP Main0.up",
                                         "Part g_config.MAIN0.UP.INNER Main0.up.inner",
                                         "Counter g_config.MAIN0.KIND_ Main0.kind",
                                         "Part g_config.MAIN0.KIND_.INNER Main0.kind.inner",
                                         "Counter g_config.MAIN0.LINE[-1] Main0.line[-1]",
                                         "Part g_config.MAIN0.LINE[-1].INNER Main0.line[-1].inner",
                                         "Counter g_config.MAIN0.GRID(0, 12) Main0.grid[0][12]",
                                         "Part g_config.MAIN0.GRID(0, 12).INNER Main0.grid[0][12].inner"));
}

TEST(StrucppInstances, AreThoseWithVariablesIfThereAreSuch) {
  EXPECT_THAT(instances({"Main0.n", "Main0.up.n", "Main0.GRID[][].N", "Main0.grid[][].inner.X"}),
              ElementsAre("Main g_config.MAIN0 Main0", "Counter g_config.MAIN0.UP Main0.up",
                          "Counter g_config.MAIN0.GRID(0, 12) Main0.grid[0][12]",
                          "Part g_config.MAIN0.GRID(0, 12).INNER Main0.grid[0][12].inner"));
}

}  // namespace
}  // namespace plchost::strucpp
