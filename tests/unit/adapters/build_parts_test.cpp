// The parts of a build that touch files and other programs.
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <sys/stat.h>
#include <unistd.h>

#include "instances/adapters/build_application.hpp"
#include "instances/adapters/c_compiler.hpp"
#include "instances/adapters/output_file.hpp"
#include "instances/adapters/run_program.hpp"
#include "instances/adapters/text_files.hpp"
#include "instances/adapters/work_folder.hpp"
#include "tests/support/own_name.hpp"

namespace plchost {
namespace {

namespace fs = std::filesystem;
using std::chrono::milliseconds;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

class BuildParts : public testing::Test {
 protected:
  BuildParts() { fs::create_directories(folder_); }
  ~BuildParts() override { fs::remove_all(folder_); }
  [[nodiscard]] std::string path(const std::string& name) const { return folder_ + "/" + name; }
  std::string put(const std::string& name, const std::string& text) const {
    fs::create_directories(fs::path(path(name)).parent_path());
    std::ofstream(path(name)) << text;
    return path(name);
  }
  static std::string read(const std::string& file) {
    std::ifstream stream(file);
    return {std::istreambuf_iterator<char>(stream), {}};
  }
  [[nodiscard]] std::size_t files() const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()));
  }

 private:
  std::string folder_ = own_path("parts");
};

TEST_F(BuildParts, TheCompilerIsCalledByWordsAsMakeDoes) {
  EXPECT_THAT(c_compiler_words(nullptr).value(), ElementsAre("cc"));
  EXPECT_THAT(c_compiler_words("").value(), ElementsAre("cc"));
  EXPECT_THAT(c_compiler_words("ccache gcc -m64").value(), ElementsAre("ccache", "gcc", "-m64"));
  EXPECT_THAT(c_compiler_words("gcc '-DNAME=a b'").value(), ElementsAre("gcc", "-DNAME=a b"));
  for (const char* no_command : {"gcc; echo", "gcc $(echo x)", "gcc 'open"}) {
    EXPECT_FALSE(c_compiler_words(no_command)) << no_command;
  }
}

TEST_F(BuildParts, AnOutputThatIsNotKeptLeavesAllAsItWas) {
  const std::string made = put("made", "new");
  const std::string old = put("line.so", "old");
  {
    auto output = OutputFile::make(made, old);
    ASSERT_TRUE(output) << output.error().describe();
    EXPECT_EQ(read(old), "old") << "not published yet";
    ASSERT_TRUE(output->publish());
    EXPECT_EQ(read(old), "new");
  }
  EXPECT_EQ(read(old), "old");
  {
    auto output = OutputFile::make(made, path("other.so"));
    ASSERT_TRUE(output && output->publish());
  }
  EXPECT_EQ(files(), 2U);
}

TEST_F(BuildParts, AnOutputThatIsKeptIsAloneInItsPlace) {
  const std::string made = put("made", "new");
  const std::string old = put("line.so", "old");
  {
    auto output = OutputFile::make(made, old);
    ASSERT_TRUE(output && output->publish());
    output->keep();
  }
  EXPECT_EQ(read(old), "new");
  EXPECT_EQ(files(), 2U);
}

TEST_F(BuildParts, AnOutputIsAPlainFileInAFolderThatIsThere) {
  EXPECT_THAT(why_no_output(path("none/line.so")), HasSubstr("there is no folder"));
  EXPECT_THAT(why_no_output(path("")), HasSubstr("is a folder"));
  EXPECT_THAT(why_no_output("/dev/null"), HasSubstr("is not a plain file"));
  EXPECT_THAT(why_no_output("/proc/line.so"), HasSubstr("no file can be made in the folder /proc: "));
  EXPECT_THAT(why_no_output(path("line.so")), IsEmpty());
}

TEST_F(BuildParts, AKeptFolderHasNothingOfTheUser) {
  (void)put("mine.c", "x");
  const auto refused = WorkFolder::make_kept(path(""));
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().describe(), HasSubstr("mine.c is not of an earlier build"));
  EXPECT_EQ(read(path("mine.c")), "x");

  for (int build = 0; build < 2; ++build) {
    auto kept = WorkFolder::make_kept(path("kept"));
    ASSERT_TRUE(kept) << kept.error().describe();
    EXPECT_TRUE(kept->write("joined.st", "text")) << "a file of the build before is gone";
  }
  EXPECT_EQ(read(path("kept/joined.st")), "text");
  (void)put("kept/mine.c", "x");
  EXPECT_FALSE(WorkFolder::make_kept(path("kept")));
}

TEST_F(BuildParts, ATemporaryFolderGoesWithTheBuild) {
  std::string where;
  {
    auto folder = WorkFolder::make_temporary();
    ASSERT_TRUE(folder) << folder.error().describe();
    where = folder->path();
    ASSERT_TRUE(folder->write("a", "b"));
    EXPECT_TRUE(folder->check_room());
    EXPECT_EQ(folder->read("a").value(), "b");
    EXPECT_FALSE(folder->read("none"));
  }
  EXPECT_FALSE(fs::exists(where));
}

TEST_F(BuildParts, AFileIsNotWrittenOverOneThatIsThere) {
  const std::string there = put("there", "old");
  fs::create_symlink(there, path("link"));
  EXPECT_EQ(write_new_file(path("link"), "new").error().code, ErrorCode::already_exists);
  EXPECT_EQ(read(there), "old");
  EXPECT_THAT(read_text_file(path("none"), 10).error().describe(), HasSubstr("none cannot be read"));
  EXPECT_THAT(read_text_file(path(""), 10).error().describe(), HasSubstr("is not a plain file"));
  EXPECT_EQ(read_text_file(there, 2).error().code, ErrorCode::wrong_size);
}

TEST_F(BuildParts, AProgramEndsWithItsChildrenAtItsLimitOrWhenItIsCancelled) {
  const std::string pid = path("pid");
  const std::vector<std::string> hangs{"sh", "-c", "sleep 1000 & echo $! >" + pid + "; echo said; wait"};
  const auto child_is_gone = [&] {
    const pid_t child = std::stoi(read(pid));
    for (int i = 0; i < 2000 && ::kill(child, 0) == 0; ++i) ::usleep(10'000);
    return ::kill(child, 0) != 0;
  };
  const auto late = run_program(hangs, path(""), {.time = milliseconds(500)});
  ASSERT_TRUE(late);
  EXPECT_TRUE(late->over_limit);
  EXPECT_FALSE(late->success());
  EXPECT_EQ(late->output, "said\n");
  EXPECT_TRUE(child_is_gone());
  const auto cancelled = run_program(hangs, path(""), {.cancelled = [&] { return !read(pid).empty(); }});
  ASSERT_TRUE(cancelled);
  EXPECT_TRUE(cancelled->cancelled);
  EXPECT_TRUE(child_is_gone());
}

TEST_F(BuildParts, ABuildWritesOverNoneOfItsSources) {
  const std::string source = put("line.st", R"(
PROGRAM Main VAR a : INT; END_VAR a := 1; END_PROGRAM
CONFIGURATION c RESOURCE r ON PLC TASK t (INTERVAL := T#1s, PRIORITY := 1); PROGRAM p WITH t : Main; END_RESOURCE END_CONFIGURATION
)");
  ASSERT_EQ(::link(source.c_str(), path("other.so").c_str()), 0);
  const auto said = [&](const std::string& output, const std::string& keep) {
    const BuildReport report = build_application({.sources = {source},
                                                  .output = output,
                                                  .matiec = "/nowhere",
                                                  .adapters = "",
                                                  .keep = keep,
                                                  .check_program = ""});
    return report.problems.empty() ? "" : iec::describe(report.problems.front());
  };
  EXPECT_THAT(said(source, ""), HasSubstr("is one of the files that are read"));
  EXPECT_THAT(said(path("other.so"), ""), HasSubstr("is one of the files that are read"));
  EXPECT_THAT(said(path("line.so"), path("")), HasSubstr("lies in the folder of --keep"));
  EXPECT_THAT(said(path("line.so"), ""), HasSubstr("there is no built MATIEC"));
}

TEST_F(BuildParts, SourcesWithoutAConfigurationAreNamed) {
  const std::string one = put("one.st", "PROGRAM Main VAR a : INT; END_VAR a := ; END_PROGRAM\n");
  const std::string two = put("two.st", "TYPE Mode : INT; END_TYPE\n");
  const auto said = [&](std::vector<std::string> sources, const std::string& matiec) {
    const BuildReport report = build_application({.sources = std::move(sources),
                                                  .output = path("line.so"),
                                                  .matiec = matiec,
                                                  .adapters = "",
                                                  .keep = "",
                                                  .check_program = ""});
    return report.problems.empty() ? "" : iec::describe(report.problems.front());
  };
  EXPECT_THAT(said({one}, "/nowhere"), HasSubstr(one + ": there is no CONFIGURATION in this file"));
  EXPECT_THAT(said({one}, "/nowhere"), HasSubstr("Write these lines in a source of the build:\n"
                                                 "  CONFIGURATION config0 RESOURCE resource0 ON PLC\n"
                                                 "    TASK task0 (INTERVAL := T#20ms, PRIORITY := 1);\n"
                                                 "    PROGRAM instance0 WITH task0 : Main;\n"
                                                 "  END_RESOURCE END_CONFIGURATION"));
  EXPECT_THAT(said({two}, "/nowhere"), testing::EndsWith("which says what its tasks are"));
  EXPECT_THAT(said({one, two}, "/nowhere"), HasSubstr("there is no CONFIGURATION in " + one + ", " + two));

  // A compiler that finds something says more.
  fs::create_directories(path("matiec/lib/C"));
  (void)put("matiec/lib/ieclib.txt", "");
  (void)put("matiec/lib/C/iec_std_lib.h", "");
  fs::permissions(put("matiec/iec2c", "#!/bin/sh\necho 'joined.st:1-41..1-41: error: wrong'\nexit 1\n"),
                  fs::perms::owner_all);
  EXPECT_EQ(said({one}, path("matiec")), one + ":1:40: wrong");
}

TEST_F(BuildParts, OfAFolderTheSourcesAtAnyDepthAreTaken) {
  const std::string one = put("line/press/one.ST", "TYPE Mode : INT; END_TYPE\n");
  const std::string two = put("line/two.st", "TYPE Kind : INT; END_TYPE\n");
  (void)put("line/note.txt", "no source");
  (void)put("line/.git/three.st", "hidden");
  (void)put("line/._two.st", "hidden");
  (void)put("line/made/joined.st", "of an earlier build");
  (void)put("line/made/.plchost-build", "");
  const BuildReport report = build_application({.sources = {path("line")},
                                                .output = path("line.so"),
                                                .matiec = "/nowhere",
                                                .adapters = "",
                                                .keep = "",
                                                .check_program = ""});
  ASSERT_EQ(report.problems.size(), 1U);
  EXPECT_THAT(report.problems.front().text,
              HasSubstr("there is no CONFIGURATION in " + one + ", " + two + ";"));
}

TEST_F(BuildParts, ATaskFileLiesBesideASourceOrInItsFolder) {
  const std::string source = put("line/a.st", R"(
PROGRAM Main VAR a : INT; END_VAR a := 1; END_PROGRAM
CONFIGURATION c RESOURCE r ON PLC TASK t (INTERVAL := T#1s, PRIORITY := 1); PROGRAM p WITH t : Main; END_RESOURCE END_CONFIGURATION
)");
  const auto said = [&](const std::string& from) {
    const BuildReport report = build_application({.sources = {from},
                                                  .output = path("line.so"),
                                                  .matiec = "/nowhere",
                                                  .adapters = "",
                                                  .keep = "",
                                                  .check_program = ""});
    std::string text;
    for (const auto& remark : report.remarks) text += iec::describe(remark) + "\n";
    return report.problems.empty() ? text : text + iec::describe(report.problems.front());
  };
  const auto alone = [&](const std::string& name, const std::string& from) {
    const std::string file = put(name, "");
    const std::string text = said(from);
    fs::remove(file);
    return text.starts_with(file + ": is read as the task file of " + from);
  };
  EXPECT_TRUE(alone("line/a.toml", source));
  EXPECT_TRUE(alone("line/a.toml", path("line")));
  EXPECT_TRUE(alone("line/tasks.toml", path("line")));
  EXPECT_TRUE(alone("line.toml", path("line")));
  EXPECT_TRUE(alone("line.toml", path("line/")));
  EXPECT_FALSE(alone("line/tasks.toml", source));
  const std::string one = put("line/tasks.toml", "");
  const std::string two = put("line.toml", "");
  EXPECT_EQ(said(path("line")), one + ": and " + two + " may both be the task file: choose by --tasks");
}

TEST_F(BuildParts, OfTwoConfigurationsTheSecondOneIsTold) {
  const std::string source =
      put("line.st", "CONFIGURATION a END_CONFIGURATION\nCONFIGURATION b END_CONFIGURATION\n");
  const BuildReport report = build_application({.sources = {source},
                                                .output = path("line.so"),
                                                .matiec = "/nowhere",
                                                .adapters = "",
                                                .keep = "",
                                                .check_program = ""});
  ASSERT_FALSE(report.problems.empty());
  EXPECT_THAT(iec::describe(report.problems.front()),
              HasSubstr(source + ":2:1: the sources have 2 CONFIGURATIONs"));
}

// Stands in for STruC++: it says what STruC++ says.
class TranslatedByStrucpp : public BuildParts {
 protected:
  TranslatedByStrucpp() {
    fs::create_directories(path("strucpp/dist/node"));
    fs::create_directories(path("strucpp/libs"));
    fs::create_directories(path("strucpp/src/runtime/include"));
    (void)put("strucpp/src/runtime/include/iec_std_lib.hpp", "");
  }
  void SetUp() override {
    if (std::system("node --version >/dev/null 2>&1") != 0)  // NOLINT(concurrency-mt-unsafe): one thread here
      GTEST_SKIP() << "needs node";
  }
  std::string said(std::vector<std::string> sources, const std::string& body_of_compile) {
    const BuildReport report = build(std::move(sources), body_of_compile);
    return report.problems.empty() ? "" : iec::describe(report.problems.front());
  }
  BuildReport build(std::vector<std::string> sources, const std::string& body_of_compile) {
    (void)put("strucpp/dist/node/index.js",
              "exports.discoverStlibs = () => [];\nexports.compile = (source, options) => {" +
                  body_of_compile + "};\n");
    return build_application({.sources = std::move(sources),
                              .output = path("line.so"),
                              .compiler = "strucpp",
                              .matiec = "",
                              .strucpp = path("strucpp"),
                              .adapters = ADAPTERS,
                              .keep = path("kept"),
                              .check_program = ""});
  }
};

// As if it had translated no program.
constexpr const char* kNothing =
    "return {success: true, errors: [], warnings: [], headerCode: '', cppFiles: [], projectModel: {}, "
    "symbolTables: {}, "
    "ast: {functionBlocks: [], functions: [], types: [], programs: [], interfaces: [], configurations: [], "
    "globalVarBlocks: [{declarations: [{names: ['OUTSIDE'], type: {name: 'INT'}}]}]}};";

TEST_F(TranslatedByStrucpp, AWordThatItTakesForAnotherOneIsRefused) {
  const std::string one = put("one.st", "PROGRAM p\nVAR PERSISTENT a : INT; END_VAR\nEND_PROGRAM\n");
  EXPECT_THAT(said({one}, kNothing), HasSubstr(one + ":2:5: PERSISTENT: STruC++ does not know this word"));
}

TEST_F(TranslatedByStrucpp, OfManyMessagesTheOthersAreCounted) {
  const std::string one = put("one.st", "PROGRAM p\nEND_PROGRAM\n");
  const auto errors = [](int count) {
    return "return {success: false, warnings: [], errors: Array.from({length: " + std::to_string(count) +
           "}, (_, i) => ({message: `${i}`, line: 1, column: i, file: '/one'}))};";
  };
  const BuildReport report = build({one}, errors(137));
  ASSERT_EQ(report.problems.size(), 101U);
  EXPECT_EQ(report.problems.back().text, "37 more messages of this kind are not told");
  EXPECT_EQ(build({one}, errors(100)).problems.size(), 100U);
}

TEST_F(TranslatedByStrucpp, AVariableOfAnInterfaceIsToldWhereItIsDeclared) {
  const std::string one = put("one.st", "INTERFACE Runs END_INTERFACE (* a : Runs *)\n");
  const std::string two = put("two.st", "PROGRAM p\nVAR a : INT; b, c : RUNS; END_VAR\nEND_PROGRAM\n");
  const std::string ends =
      "throw new TypeError(\"Cannot read properties of undefined (reading 'definition')\");";
  EXPECT_EQ(said({one, two}, ends), two + ":2:17: STruC++ knows no variables of an interface");
  EXPECT_THAT(said({one}, ends), HasSubstr(one + ": Cannot read properties"));
}

TEST_F(TranslatedByStrucpp, VariablesOutsideOfItsTableAreInThePlan) {
  (void)put("strucpp/dist/backend/debug-table-gen.js", R"(
exports.generateDebugTable = ({configurations}) => ({
  debugTableCpp: configurations.flatMap(({varBlocks}) => varBlocks.flatMap(({declarations}) => declarations.flatMap(({names}) => names)))
    .map((name) => `    { (void*)&${name}.value, TAG_INT, 0 },  // ${name}`).join('\n'),
  skipped: [{path: 'ONE.CAL[1].X', reason: 'library type Calendar is opaque to the debugger'},
            {path: 'ONE.CAL[2].X', reason: 'library type Calendar is opaque to the debugger'},
            {path: 'ONE.A', reason: 'array bounds not constant'}, {path: 'B', reason: 'other'}],
}))");
  (void)build({put("one.st", "PROGRAM p\nEND_PROGRAM\n")}, kNothing);
  const std::string plan = read(path("kept/plan.json"));
  EXPECT_THAT(plan,
              HasSubstr(R"("symbols":[{"name":"OUTSIDE","type":"INT","value":"OUTSIDE","bounds":[]}])"));
  EXPECT_THAT(plan,
              HasSubstr(R"("hidden":[{"name":"ONE.CAL[].X","why":"its type Calendar is one of a library"},)"
                        R"({"name":"ONE.A","why":"its bounds are no numbers"},)"
                        R"({"name":"B","why":"STruC++ leaves it out: other"}])"));
}

TEST_F(TranslatedByStrucpp, ACharacterThatIsNotExpectedIsToldAtItsPlace) {
  const std::string one = put("one.st", "TYPE\nEND_TYPE\n");
  const std::string two = put("two.st", "\n\n  a := @;\n");
  const auto errors = [](const std::string& file, int offset) {
    return "return {success: false, warnings: [], errors: [{message: 'unexpected character: ->@<- at "
           "offset: " +
           std::to_string(offset) + ", skipped 1 characters.', line: 0, column: 0, file: '" + file + "'}]};";
  };
  EXPECT_EQ(said({one, two}, errors(two, 9)), two + ":3:8: unexpected character '@'");
  EXPECT_THAT(said({one, two}, errors(two, 3)), HasSubstr(two + ": unexpected character: ->@<-"))
      << "the offset is none of the source";
}

TEST_F(TranslatedByStrucpp, AnErrorWithoutAFileIsToldOfTheLastOneThatHasItsWord) {
  const std::string one = put("one.st", "FUNCTION_BLOCK Pump\nEND_FUNCTION_BLOCK\n");
  const std::string two = put("two.st", "FUNCTION_BLOCK pump\nEND_FUNCTION_BLOCK\n");
  const std::string three = put("three.st", "FUNCTION_BLOCK Pumps\nEND_FUNCTION_BLOCK\n");
  EXPECT_EQ(said({one, two, three},
                 "return {success: false, warnings: [], errors: [{message: 'Duplicate function block "
                 "declaration: PUMP', line: 1, column: 1}]};"),
            two + ":1:1: Duplicate function block declaration: PUMP");
}

TEST_F(TranslatedByStrucpp, ItsTextHasNoPlacesOfProgramsAndOfOneResourceNoGlobals) {
  const std::string one = put("one.st",
                              "PROGRAM p VAR a AT %IX0.0 : BOOL; END_VAR END_PROGRAM CONFIGURATION c\n"
                              "RESOURCE r ON PLC VAR_GLOBAL b : INT; END_VAR TASK t (X := 1); END_RESOURCE\n"
                              "END_CONFIGURATION");
  EXPECT_EQ(
      said({one}, "return {success: false, warnings: [], errors: [{message: source, line: 2, column: 65}]};"),
      one + ":2:47: PROGRAM p VAR a" + std::string(11, ' ') + ": BOOL; END_VAR END_PROGRAM CONFIGURATION c" +
          std::string(19, ' ') +
          "VAR_GLOBAL b : INT; END_VAR RESOURCE r ON PLC TASK t (X := 1); END_RESOURCE END_CONFIGURATION")
      << "the column is that of the source";
}

TEST_F(TranslatedByStrucpp, ALetterThatIsNotAsciiIsToldAsItIsWritten) {
  const std::string one = put("one.st", "\n z\xC3\xA4hler := 1;\n");
  EXPECT_EQ(said({one},
                 "return {success: false, warnings: [], errors: [{message: 'unexpected character: ->"
                 "\xC3\x84<- at offset: 3, skipped 1 characters.', line: 0, column: 0}]};"),
            one + ":2:3: unexpected character '\xC3\xA4'");
}

TEST_F(TranslatedByStrucpp, ACommentWithoutAnEndIsToldWhereItBegins) {
  const std::string one = put("one.st", "(* done *) a := '(*'; // (*\n");
  const std::string two = put("two.st", "\n  b := 1; (* open\n  c := 2;\n");
  EXPECT_EQ(said({one, two}, "throw new Error('Unclosed block comment');"),
            two + ":2:11: this comment has no end");
}

TEST_F(TranslatedByStrucpp, AGlobalFunctionBlockIsToldWhereItIsDeclared) {
  const std::string one = put("one.st", "PROGRAM p\nVAR_EXTERNAL gf : fb; END_VAR\ngf();\nEND_PROGRAM\n");
  const std::string two = put(
      "two.st", "CONFIGURATION c\nVAR_GLOBAL (* gf *)\n  n : INT; gf : fb;\nEND_VAR\nEND_CONFIGURATION\n");
  EXPECT_EQ(said({one, two}, "throw new Error(\"Shared global 'GF' is a function-block instance\");"),
            two + ":3:12: Shared global 'GF' is a function-block instance");
}

}  // namespace
}  // namespace plchost
