// The plan that translate.mjs writes of a program, and the C++ that is made of it. The plans have the form of
// those of STruC++ 0.6.2, so these tests need no compiler.
#include <array>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>

#include "instances/adapters/iec/task_file.hpp"
#include "instances/adapters/strucpp/compiler.hpp"
#include "instances/adapters/strucpp/glue.hpp"
#include "instances/adapters/strucpp/plan_file.hpp"
#include "tests/unit/adapters/problem_texts.hpp"

namespace plchost::strucpp {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

std::string variable(const std::string& name, const std::string& type, const std::string& more = "") {
  std::string text =
      R"({"name":"NAME","type":"TYPE","location":"LOCATION","section":"SECTION","retain":RETAIN,)"
      R"("constant":false,"place":[0,4,7],"member":"MEMBER"})";
  const auto replace = [&](const std::string& word, const std::string& value) {
    text.replace(text.find(word), word.size(), value);
  };
  const auto option = [&](const std::string& key, const std::string& usual) {
    const std::size_t at = more.find(key + "=");
    if (at == std::string::npos) return usual;
    const std::size_t begin = at + key.size() + 1;
    return more.substr(begin, more.find(';', begin) - begin);
  };
  replace("NAME", name);
  replace("TYPE", type);
  replace("LOCATION", option("at", ""));
  replace("SECTION", option("section", "local"));
  replace("RETAIN", option("retain", "false"));
  replace("MEMBER", option("member", name));
  return text;
}

struct Parts {
  std::string main = variable("RAW", "INT", "at=%IW1") + "," + variable("TOTAL", "DINT", "retain=true") +
                     "," + variable("PUMP", "PUMP", "member=PUMP_") + "," +
                     variable("LATE", "TON", "retain=true") + "," +
                     variable("LINK", "REFERENCE INT", "retain=true") + "," +
                     variable("GO", "BOOL", "section=external;member=");
  std::string globals = variable("GO", "BOOL", "at=%IX0.0;section=global;member=GO.value") + "," +
                        variable("SPEED", "INT", "section=global;retain=true;member=SPEED.value");
  std::string tasks = R"({"name":"fast","interval":"T#2MS","single":"","priority":"1","place":[0,9,5]},)"
                      R"({"name":"edge","interval":"","single":"GO","priority":"0","place":[0,10,5]})";
  std::string programs = R"({"name":"one","type":"MAIN","task":"FAST","place":[0,11,5]},)"
                         R"({"name":"two","type":"OTHER","task":"EDGE","place":[0,12,5]},)"
                         R"({"name":"rest","type":"IDLE","task":"","place":[0,13,5]})";
  std::string symbols = R"({"name":"ONE.TOTAL","type":"DINT","value":"g_config.ONE.TOTAL","bounds":[]})";
  std::string hidden;
  std::string head = R"("problems":[],"remarks":[])";

  [[nodiscard]] std::string text() const {
    const auto pou = [](const std::string& kind, const std::string& name, const std::string& variables) {
      return R"({"kind":")" + kind + R"(","name":")" + name + R"(","place":[0,1,1],"variables":[)" +
             variables + "]}";
    };
    return R"({"format":1,)" + head + R"(,"files":["configuration.cpp","pou_MAIN.cpp"],"pous":[)" +
           pou("program", "MAIN", main) + "," +
           pou("program", "OTHER", variable("GO", "BOOL", "section=external;member=")) + "," +
           pou("program", "IDLE", "") + "," + pou("function_block", "PUMP", variable("HOURS", "DINT")) + "," +
           pou("function_block", "TON", variable("START_TIME", "IEC_TIME")) + R"(],"types":[],"symbols":[)" +
           symbols + R"(],"hidden":[)" + hidden +
           R"(],"configurations":[{"name":"cell","place":[0,8,1],"globals":[)" + globals +
           R"(],"resources":[{"name":"press","place":[0,8,1],"tasks":[)" + tasks + R"(],"programs":[)" +
           programs + "]}]}]}";
  }
};

ReadPlan read(const Parts& parts) {
  const std::vector<std::string> sources{"a.st"};
  auto plan = read_plan(parts.text(), sources);
  EXPECT_TRUE(plan) << plan.error().describe();
  return plan ? *std::move(plan) : ReadPlan{};
}

iec::Glue glue_of(const Parts& parts, const std::string& task_file = "") {
  ReadPlan plan = read(parts);
  EXPECT_THAT(texts(plan.problems), IsEmpty());
  iec::Configuration& configuration = plan.project.configurations.at(0);
  EXPECT_THAT(texts(iec::read_task_file({"c.toml", task_file}, configuration)), IsEmpty());
  return write_glue(plan.project, configuration, configuration.resources.at(0), plan.files, plan.symbols);
}

TEST(StrucppGlue, RunsEachTaskByItself) {
  const iec::Glue glue = glue_of({});
  EXPECT_THAT(texts(glue.problems), IsEmpty());
  EXPECT_THAT(glue.text, HasSubstr("#include \"plchost_strucpp.hpp\"\n#include \"configuration.cpp\"\n"
                                   "#include \"pou_MAIN.cpp\"\n\nstrucpp::Configuration_CELL g_config;\n"));
  EXPECT_THAT(glue.text, HasSubstr("plchost_begin(0);\n  plchost_run(g_config.ONE);\n  plchost_end(0);"));
  EXPECT_THAT(glue.text, HasSubstr("{\"fast\", 1, 2000000L, 0, plchost_run_0,"));
  EXPECT_THAT(glue.text, HasSubstr("plchost_edge_1(void) { return *strucpp::GO.value.raw_ptr() ? 1 : 0; }"));
  EXPECT_THAT(glue.text, HasSubstr("{\"edge\", 0, 0L, plchost_edge_1, plchost_run_1,"));
  EXPECT_THAT(glue.text, HasSubstr("{\"rest\", 31, 0L, 0, plchost_run_2,"));
  EXPECT_THAT(texts(glue.remarks),
              Contains("a.st:13:5: PROGRAM rest has no TASK: it runs freewheeling, with priority 31"));
}

TEST(StrucppGlue, PlacesLocationsAsTheTaskFileSays) {
  Parts parts;
  parts.main += "," + variable("HIGH", "INT", "at=%QW0.1.8192.1") + "," +
                variable("LOW", "INT", "at=%QW0.1.8192.0") + "," + variable("LAMP", "BOOL", "at=%QX0.0");
  const iec::Glue chosen = glue_of(parts);
  EXPECT_THAT(texts(chosen.problems), IsEmpty());
  EXPECT_THAT(chosen.text, HasSubstr("{\"ONE.HIGH\", 'Q', 2, -1, 0, 4u, &*g_config.ONE.HIGH.raw_ptr()}"));
  EXPECT_THAT(chosen.text, HasSubstr("{\"ONE.LOW\", 'Q', 2, -1, 0, 2u, &*g_config.ONE.LOW.raw_ptr()}"));
  EXPECT_THAT(
      texts(chosen.remarks),
      Contains("a.st:4:7: %QW0.1.8192.0 lies in bytes 2 to 3 of the outputs. It may move in a later "
               "build, unless [location] of the task file has the line \"%QW0.1.8192.0\" = \"%QW1\""));
  const iec::Glue given = glue_of(
      parts, "locations = 'separate'\n[location]\n'%QW0.1.8192.0' = '%QW7'\n'%QW0.1.8192.1' = '%QW7'");
  EXPECT_THAT(given.text, HasSubstr("{\"ONE.LOW\", 'Q', 2, -1, 1, 2062u, "));
  EXPECT_THAT(given.text, HasSubstr("{\"ONE.LAMP\", 'Q', 1, 0, 0, 0u, "));
  EXPECT_THAT(given.text, HasSubstr("{\"ONE.RAW\", 'I', 2, -1, 0, 2050u, "));
  EXPECT_THAT(texts(given.remarks), Contains(HasSubstr("%QW0.1.8192.0 shares its bits with %QW0.1.8192.1")));
}

TEST(StrucppGlue, ExchangesTheVariablesWhereTheyLie) {
  const iec::Glue glue = glue_of({});
  EXPECT_THAT(glue.text, HasSubstr("{\"ONE.RAW\", 'I', 2, -1, 0, 2u, &*g_config.ONE.RAW.raw_ptr()},\n"
                                   "  {\"GO\", 'I', 1, 0, 0, 0u, &*strucpp::GO.value.raw_ptr()}"));
  EXPECT_THAT(glue.text, HasSubstr("plchost_uses_0[] = {\n  {0, &*g_config.ONE.RAW.raw_ptr(), 0, 0},\n"
                                   "  {1, &*strucpp::GO.value.raw_ptr(), 0, 0},\n  {0}}"));
  EXPECT_THAT(glue.text,
              HasSubstr("plchost_uses_1[] = {\n  {1, &*strucpp::GO.value.raw_ptr(), 0, 0},\n  {0}}"));
  EXPECT_THAT(glue.text, HasSubstr("plchost_uses_2[] = {\n  {0}}"));
}

TEST(StrucppGlue, KnowsEachVariableByItsNameInTheSource) {
  const iec::Glue glue = glue_of({});
  EXPECT_THAT(glue.text, HasSubstr("v.path = \"ONE.TOTAL\"; v.value = &g_config.ONE.TOTAL; v.bytes = sizeof "
                                   "g_config.ONE.TOTAL;"));
  EXPECT_THAT(glue.text, HasSubstr("v.path = \"ONE.PUMP.HOURS\"; v.value = &g_config.ONE.PUMP_.HOURS;"));
  EXPECT_THAT(glue.text, HasSubstr("v.path = \"SPEED\"; v.value = &strucpp::SPEED.value;"));
  EXPECT_THAT(glue.text, Not(HasSubstr("v.path = \"ONE.LINK\""))) << "it points into this version";
  EXPECT_THAT(glue.text, Not(HasSubstr("v.path = \"GO\""))) << "it is located";
  EXPECT_THAT(texts(glue.remarks),
              Contains("a.st:4:7: RETAIN of LINK is not carried out: it has references"));
  EXPECT_THAT(texts(glue.remarks),
              Contains("a.st:4:7: LATE is a TON: a timer begins anew at each start, RETAIN or not"));
}

TEST(StrucppGlue, RetainsInTheTasksThatMayChangeAVariable) {
  Parts parts;
  parts.main += "," + variable("SPEED", "INT", "section=external;member=");
  const iec::Glue glue = glue_of(parts);
  EXPECT_THAT(glue.text, HasSubstr("plchost_retained_0[] = {0, 1, 0};"));
  EXPECT_THAT(glue.text, HasSubstr("plchost_retained_1[] = {0};"));
}

TEST(StrucppGlue, HasTheTasksOfATaskFile) {
  const iec::Glue glue =
      glue_of({}, "[task.REST]\nexternal_event='product'\n[task.fast]\nwatchdog_time='5ms'\n");
  EXPECT_THAT(glue.text,
              HasSubstr("{\"rest\", 31, 0L, 0, plchost_run_2, 0, plchost_uses_2, 0, plchost_retained_2, "
                        "\"product\", 0, 0},"));
  EXPECT_THAT(glue.text, HasSubstr("plchost_options_0 = {0L, 0, 0, 5000u, 1u, 0u, 0};"));
}

TEST(StrucppGlue, RefusesTwoInstancesOfOneName) {
  Parts parts;
  parts.programs += R"(,{"name":"ONE","type":"IDLE","task":"FAST","place":[0,14,5]})";
  EXPECT_THAT(texts(glue_of(parts).problems),
              Contains("a.st:14:5: PROGRAM ONE: STruC++ wants another name for each instance of the "
                       "CONFIGURATION, and there is one of this name"));
}

TEST(StrucppGlue, RefusesOutputsOfTwoTasksThatShareBits) {
  Parts parts;
  parts.main = variable("A", "BOOL", "at=%QX0.1");
  std::string text = parts.text();
  const std::string other = variable("GO", "BOOL", "section=external;member=");
  text.replace(text.find(other), other.size(), variable("B", "BOOL", "at=%QX0.1"));
  const std::vector<std::string> sources{"a.st"};
  ReadPlan plan = read_plan(text, sources).value();
  const iec::Configuration& configuration = plan.project.configurations.at(0);
  EXPECT_THAT(
      texts(write_glue(plan.project, configuration, configuration.resources.at(0), plan.files, {}).problems),
      Contains(HasSubstr("%QX0.1 and %QX0.1 share bits, and the tasks fast, edge use them")));
}

// A variable of a program has a value of its own.
TEST(StrucppGlue, ReadsTheInputOfAnEdgeInACyclicTask) {
  Parts parts;
  parts.main = variable("RAW", "BOOL", "at=%IX0.0");
  const iec::Glue glue = glue_of(parts);
  EXPECT_THAT(texts(glue.problems), IsEmpty());
  EXPECT_THAT(texts(glue.remarks), Contains("a.st:10:5: SINGLE of edge: the task fast reads GO at %IX0.0, as "
                                            "no cyclic program has it in VAR_EXTERNAL"));
  EXPECT_THAT(glue.text, HasSubstr("plchost_uses_0[] = {\n  {0, &*g_config.ONE.RAW.raw_ptr(), 0, 0},\n"
                                   "  {1, &*strucpp::GO.value.raw_ptr(), 0, 0},\n  {0}}"));
}

TEST(StrucppGlue, RefusesAnEdgeOfNoVariable) {
  Parts parts;
  const std::string single = R"("single":"GO")";
  parts.tasks.replace(parts.tasks.find(single), single.size(), R"("single":"NONE")");
  EXPECT_THAT(texts(glue_of(parts).problems),
              Contains("a.st:10:5: SINGLE of edge: 'NONE' is no BOOL of a VAR_GLOBAL"));
}

std::string symbol(const std::string& name, const std::string& type, const std::string& value,
                   const std::string& bounds = "") {
  return fmt::format(R"({{"name":"{}","type":"{}","value":"{}","bounds":[{}]}})", name, type, value, bounds);
}

TEST(StrucppSymbols, TellTheirTasksPlacesAndNamesOfTheSource) {
  Parts parts;
  parts.main = variable("raw", "INT", "at=%IW1") + "," + variable("pump", "PUMP", "member=PUMP_") + "," +
               variable("Pumps.1", "PUMP", "member=PUMPS[1]") + "," + variable("link", "REFERENCE INT") +
               "," + variable("GO", "BOOL", "section=external;member=");
  parts.symbols = symbol("ONE.RAW", "INT", "g_config.ONE.RAW") + "," +
                  symbol("ONE.PUMP.HOURS", "DINT", "g_config.ONE.PUMP_.HOURS") + "," +
                  symbol("ONE.PUMPS[].HOURS", "DINT", "g_config.ONE.PUMPS[].HOURS", "[1,2]") + "," +
                  symbol("ONE.LINK", "INT", "g_config.ONE.LINK") + "," +
                  symbol("OTHERS.X", "INT", "g_config.OTHERS.X") + "," + symbol("GO", "BOOL", "GO.value");
  const std::string text = glue_of(parts).text;
  EXPECT_THAT(text, HasSubstr("plchost_show<0>(use, g_config, [](auto& c) -> decltype((c.ONE.RAW)) { return "
                              "c.ONE.RAW; },\n                  {\"one.raw\", 3u, 2u, 0u, \"fast\", "
                              "\"%IW1\", {}});"));
  EXPECT_THAT(text, HasSubstr("{\"one.pump.HOURS\", 4u, 4u, 0u, \"fast\", nullptr, {}}"));
  EXPECT_THAT(text, HasSubstr("[](auto& c, long i0) -> decltype((plchost_at(c.ONE.PUMPS, i0).HOURS))"));
  EXPECT_THAT(text, HasSubstr("{\"one.Pumps[].HOURS\", 4u, 4u, 0u, \"fast\", nullptr, {{1, 2u}, }}"));
  EXPECT_THAT(text, HasSubstr("plchost_show<0>(use, strucpp::GO, [](auto& c) -> decltype((c.value))"));
  EXPECT_THAT(text, HasSubstr("{\"GO\", 1u, 1u, 0u, nullptr, \"%IX0.0\", {}}")) << "two tasks use it";
  EXPECT_THAT(text, Not(HasSubstr("LINK"))) << "it has no value of its own";
  EXPECT_THAT(text, Not(HasSubstr("OTHERS")));
}

TEST(StrucppSymbols, OfArraysAreOneWithItsDimensions) {
  Parts parts;
  parts.symbols = symbol("SPEED[][].A[]", "TIME", "SPEED.value[][].A[]", "[-1,1],[0,3],[1,2]");
  const std::string text = glue_of(parts).text;
  EXPECT_THAT(text,
              HasSubstr("plchost_show<3>(use, strucpp::SPEED, [](auto& c, long i0, long i1, long i2) -> "
                        "decltype((plchost_at(plchost_at(c.value, i0, i1).A, i2)))"));
  EXPECT_THAT(text, HasSubstr("{\"SPEED[][].A[]\", 16u, 8u, 0u, nullptr, nullptr, "
                              "{{-1, 3u}, {0, 4u}, {1, 2u}, }}"));
}

TEST(StrucppSymbols, OfTextsHaveBytesOfTheirOwn) {
  Parts parts;
  parts.symbols = symbol("ONE.TOTAL", "WSTRING", "g_config.ONE.TOTAL") + "," +
                  symbol("ONE.RAW", "STRING", "g_config.ONE.RAW");
  const std::string text = glue_of(parts).text;
  EXPECT_THAT(text, HasSubstr("{\"one.TOTAL\", 31u, 0u, 0u, "));
  EXPECT_THAT(text, HasSubstr("{\"one.RAW\", 26u, 0u, 0u, "));
}

TEST(StrucppSymbols, SayWhichVariablesTheTableLeavesOut) {
  Parts parts;
  parts.symbols = symbol("ONE.LINK", "INT", "g_config.ONE.LINK");
  parts.hidden = R"({"name":"ONE.TOTAL[].UTC","why":"its type CALENDAR is one of a library"},)"
                 R"({"name":"SPEED","why":"its bounds are no numbers"},)"
                 R"({"name":"OTHERS.SPEED","why":"it is one of another resource"})";
  EXPECT_THAT(
      texts(glue_of(parts).remarks),
      testing::IsSupersetOf(
          {"a.st:4:7: one.TOTAL[].UTC cannot be seen from outside: its type CALENDAR is one of a library",
           "a.st:4:7: SPEED cannot be seen from outside: its bounds are no numbers",
           "a.st:4:7: one.LINK cannot be seen from outside: it has references"}));
  EXPECT_THAT(texts(glue_of(parts).remarks), Not(Contains(HasSubstr("another resource"))));
  parts.hidden = R"({"name":"ONE.TOTAL","why":""})";
  const auto plan = read_plan(parts.text(), std::vector<std::string>{"a.st"});
  ASSERT_FALSE(plan);
  EXPECT_THAT(plan.error().describe(), HasSubstr("hidden[0].why is ''; allowed is a reason"));
}

// A timer of a global begins anew, as each other one does.
TEST(StrucppGlue, KeepsNoTimerThatIsGlobal) {
  Parts parts;
  parts.globals += "," + variable("PAUSE", "TON", "section=global;retain=true;member=PAUSE.value");
  const iec::Glue glue = glue_of(parts);
  EXPECT_THAT(glue.text, HasSubstr("v.path = \"PAUSE.START_TIME\""));
  const std::string line = glue.text.substr(glue.text.find("v.path = \"PAUSE.START_TIME\""));
  EXPECT_THAT(line.substr(0, line.find('\n')), HasSubstr("v.retain = 0;"));
  EXPECT_THAT(texts(glue.remarks), Contains(HasSubstr("PAUSE is a TON: a timer begins anew")));
}

// Members within members have long names. The program is built all the same.
TEST(StrucppSymbols, WithALongNameAreTold) {
  Parts parts;
  const std::string member(600, 'M');
  parts.symbols = symbol("ONE.RAW." + member, "INT", "g_config.ONE.RAW." + member) + "," +
                  symbol("ONE.TOTAL", "DINT", "g_config.ONE.TOTAL");
  const iec::Glue glue = glue_of(parts);
  EXPECT_THAT(glue.text, HasSubstr("{\"one.TOTAL\", "));
  EXPECT_THAT(glue.text, Not(HasSubstr(member)));
  EXPECT_THAT(texts(glue.remarks), Contains(HasSubstr("its name has more than 250 characters")));
}

TEST(StrucppSymbols, ThatCannotBeSeenAreTold) {
  Parts parts;
  parts.symbols = symbol("ONE.TOTAL", "WCHAR", "g_config.ONE.TOTAL") + "," +
                  symbol("ONE.RAW[][].X[][]", "INT", "g_config.ONE.RAW[][].X[][]", "[0,1],[0,1],[0,1],[0,1]");
  const iec::Glue glue = glue_of(parts);
  EXPECT_THAT(glue.text, Not(HasSubstr("plchost_show<")));
  EXPECT_THAT(texts(glue.remarks), Contains("a.st:4:7: one.TOTAL cannot be seen from outside: its type is "
                                            "WCHAR"));
  EXPECT_THAT(texts(glue.remarks), Contains("a.st:4:7: one.RAW[][].X[][] cannot be seen from outside: it has "
                                            "more than 3 dimensions"));
}

TEST(StrucppPlan, RefusesSymbolsThatAreNone) {
  const std::vector<std::string> sources{"a.st"};
  for (const auto& [wrong, told] : std::vector<std::pair<std::string, std::string>>{
           {symbol("ONE.A;B", "INT", "g_config.ONE.A"), "symbols[0].name is 'ONE.A;B'; allowed is names"},
           {symbol("ONE..A", "INT", "g_config.ONE.A"), "symbols[0].name is 'ONE..A'; allowed is names"},
           {symbol("", "INT", "g_config.ONE.A"), "symbols[0].name is ''; allowed is names"},
           {symbol("ONE.A", "INT", "g_config.ONE.A."), "symbols[0].value is 'g_config.ONE.A.'; allowed"},
           {symbol("ONE.A[", "INT", "g_config.ONE.A[", "[0,1]"), "symbols[0].name is 'ONE.A['; allowed"},
           {symbol("ONE.A[]B", "INT", "g_config.ONE.A[]", "[0,1]"), "symbols[0].name is 'ONE.A[]B'; allowed"},
           {symbol("ONE.A[]", "INT", "g_config.ONE.A[]"),
            "symbols[0].bounds is '[]'; allowed is two numbers "
            "for each []"},
           {symbol("ONE.A[]", "INT", "g_config.ONE.A", "[0,1]"), "allowed is two numbers for each []"},
           {symbol("ONE.A[]", "INT", "g_config.ONE.A[]", "[2,1]"),
            "symbols[0].bounds[0] is '[2,1]'; allowed"},
           {symbol("ONE.A", "IN T", "g_config.ONE.A"), "symbols[0].type is 'IN T'; allowed is a name"}}) {
    Parts parts;
    parts.symbols = wrong;
    const auto plan = read_plan(parts.text(), sources);
    ASSERT_FALSE(plan) << told;
    EXPECT_THAT(plan.error().message, HasSubstr(told));
  }
}

TEST(StrucppPlan, TellsWhatTheCompilerFound) {
  Parts parts;
  parts.head = R"("problems":[{"place":[0,3,5],"text":"wrong"}],"remarks":[{"place":[-1,0,0],"text":"so"}])";
  const ReadPlan plan = read(parts);
  EXPECT_THAT(texts(plan.problems), ElementsAre("a.st:3:5: wrong"));
  EXPECT_THAT(texts(plan.remarks), ElementsAre("so"));
}

TEST(StrucppPlan, TellsWhatIsWrongWithATask) {
  for (const auto& [from, to, told] : std::vector<std::array<std::string, 3>>{
           {"\"1\"", "\"32\"", "a.st:9:5: PRIORITY 32: allowed is 0 (the highest) to 31"},
           {"\"1\"", "\"-1\"", "a.st:9:5: PRIORITY -1: allowed is 0 (the highest) to 31"},
           {"\"1\"", "\"\"", "a.st:9:5: TASK fast has no PRIORITY; 0 to 31 is allowed"},
           {"T#2MS", "T#-2MS", "a.st:9:5: INTERVAL T#-2MS is below 0"},
           {"\"edge\"", "\"Fast\"", "a.st:10:5: there are two TASKs 'Fast'"},
           {"\"FAST\"", "\"SLOW\"",
            "a.st:11:5: PROGRAM one runs WITH 'SLOW', and there is no such TASK in its resource"}}) {
    Parts parts;
    for (std::string* const part : {&parts.tasks, &parts.programs}) {
      if (const std::size_t at = part->find(from); at != std::string::npos)
        part->replace(at, from.size(), to);
    }
    EXPECT_THAT(texts(read(parts).problems), Contains(told));
  }
}

TEST(StrucppPlan, RefusesWhatIsNoPlan) {
  const std::string good = Parts{}.text();
  const std::vector<std::string> sources{"a.st"};
  for (const auto& [from, to, told] : std::vector<std::array<std::string, 3>>{
           {"{\"format\"", "\"format\"", "plan.json is no JSON"},
           {"\"format\":1", "\"format\":2", "format is '2'; allowed is 1 to 1"},
           {"\"types\":[],", "", "has no 'types'"},
           {"\"types\":[]", "\"types\":7", "types is '7'; allowed is a list of at most 100000 entries"},
           {"\"types\":[]", "\"more\":1,\"types\":[]", "has a 'more' that is not known"},
           {"\"program\"", "\"prog\"",
            "pous[0].kind is 'prog'; allowed is program, function_block or function"},
           {"\"local\"", "\"locale\"", "pous[0].variables[0].section is 'locale'; allowed is a section"},
           {"\"RAW\"", "\"R;W\"", "pous[0].variables[0].name is 'R;W'; allowed is a name"},
           {"PUMP_", "PUMP;x", "pous[0].variables[2].member is 'PUMP;x'; allowed is a member in C++"},
           {"%IW1", "%IW1\\\"", "pous[0].variables[0].location is"},
           {"configuration.cpp", "../a.cpp", "files[0] is '../a.cpp'; allowed is a name of a file *.cpp"},
           {"configuration.cpp", ".cpp", "files[0] is '.cpp'; allowed is"},
           {"[0,4,7]", "[1,4,7]", "pous[0].variables[0].place[0] is '1'; allowed is -1 to 0"},
           {"[0,4,7]", "[0,4]", "pous[0].variables[0].place is '[0,4]'; allowed is three numbers"},
           {"\"retain\":false", "\"retain\":0",
            "pous[0].variables[0].retain is '0'; allowed is true or false"},
           {"\"name\":\"cell\"", "\"name\":\"\"",
            "configurations[0].name is ''; allowed is a name of letters"}}) {
    std::string text = good;
    ASSERT_NE(text.find(from), std::string::npos) << from;
    text.replace(text.find(from), from.size(), to);
    const auto plan = read_plan(text, sources);
    ASSERT_FALSE(plan) << told;
    EXPECT_THAT(plan.error().message, HasSubstr(told));
  }
}

TEST(StrucppPlan, RefusesListsInListsWithoutEnd) {
  constexpr std::size_t kLists = 100'000;
  const auto plan = read_plan(std::string(kLists, '[') + std::string(kLists, ']'), {});
  ASSERT_FALSE(plan);
  EXPECT_THAT(plan.error().message, HasSubstr("more than 20 lists and objects lie within each other"));
}

TEST(StrucppCompiler, SaysHowToGetOne) {
  const auto none = find_compiler("/proc/self");
  ASSERT_FALSE(none);
  EXPECT_THAT(none.error().message, HasSubstr("there is no built STruC++ (dist/node/index.js, libs, "));
  EXPECT_THAT(none.error().message, HasSubstr("npm ci --ignore-scripts && npm run build"));
}

TEST(StrucppGlue, GivesAProgramCopiesOfItsGlobals) {
  Parts parts;
  parts.main += "," + variable("SPEED", "INT", "section=external;member=SPEED_");
  const iec::Glue glue = glue_of(parts, "[program.one]\nglobals = 'copy'\n");
  EXPECT_THAT(glue.text,
              HasSubstr("static std::remove_pointer_t<decltype(g_config.ONE.SPEED_)> plchost_copy_0;"));
  EXPECT_THAT(glue.text,
              HasSubstr("{0, &plchost_copy_0.value, &plchost_before_0, sizeof plchost_copy_0.value, "
                        "sizeof (plchost_piece(plchost_before_0)), "));
  EXPECT_THAT(glue.text, HasSubstr("strucpp::SPEED.with_lock("));
  EXPECT_THAT(glue.text, HasSubstr("plchost_copies[0].global = &strucpp::SPEED.value;\n"
                                   "  g_config.ONE.SPEED_ = &plchost_copy_0;\n"));
  EXPECT_THAT(glue.text,
              HasSubstr("plchost_take_copies(&plchost_copies[0], 1);\n  plchost_run(g_config.ONE);"));
  EXPECT_THAT(texts(glue.remarks),
              Contains(HasSubstr("PROGRAM one has no copy of GO: a part of the program uses "
                                 "it without VAR_EXTERNAL")));
}

}  // namespace
}  // namespace plchost::strucpp
