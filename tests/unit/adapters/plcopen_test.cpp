// From a project of PLCopen XML to ST.
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>

#include "instances/adapters/iec/project.hpp"
#include "instances/adapters/plcopen/iso_duration.hpp"
#include "instances/adapters/plcopen/project_file.hpp"
#include "instances/adapters/plcopen/structured_text.hpp"
#include "tests/unit/adapters/problem_texts.hpp"

namespace plchost::plcopen {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

// MATIEC takes no POU without one.
constexpr std::string_view kNoVariable = "VAR plchost_no_variable : BOOL; END_VAR\n";
constexpr std::string_view kTasks =
    "<task name='fast' interval='T#20ms' priority='1'><pouInstance name='one' typeName='Main'/></task>";

std::string project(std::string_view types, std::string_view resource = kTasks,
                    std::string_view configuration = "") {
  return fmt::format(
      "<?xml version='1.0' encoding='utf-8'?>\n"
      "<project xmlns='http://www.plcopen.org/xml/tc6_0201' xmlns:xhtml='http://www.w3.org/1999/xhtml'>\n"
      "<fileHeader companyName='a'/><contentHeader name='b'/>\n"
      "<types>{}</types>\n"
      "<instances><configurations><configuration name='cell'><resource name='press'>{}</resource>{}"
      "</configuration></configurations></instances></project>",
      types, resource, configuration);
}
std::string in_pou(std::string_view interface,
                   std::string_view body = "<ST><xhtml:p>a := 1;</xhtml:p></ST>") {
  return fmt::format(
      "<dataTypes/><pous><pou name='Main' "
      "pouType='program'><interface>{}</interface><body>{}</body></pou></pous>",
      interface, body);
}
std::string variable(std::string_view type, std::string_view value = "", std::string_view name = "a") {
  return fmt::format("<variable name='{}'><type>{}</type>{}</variable>", name, type, value);
}
std::string data_type(std::string_view base, std::string_view value = "") {
  return fmt::format("<dataTypes><dataType name='T'><baseType>{}</baseType>{}</dataType></dataTypes>", base,
                     value);
}

StructuredText read(const std::string& xml) {
  return structured_text_of({"a.xml", xml});
}
std::vector<std::string> problems_of(const std::string& xml) {
  return texts(read(xml).problems);
}
/// The text of a project in which nothing is wrong.
std::string text_of(const std::string& xml) {
  EXPECT_THAT(problems_of(xml), IsEmpty());
  return read(xml).text.text();
}
/// The declaration of a variable of this type and value.
std::string declared(std::string_view type, std::string_view value = "") {
  const std::string text =
      text_of(project(in_pou(fmt::format("<localVars>{}</localVars>", variable(type, value)))));
  const std::size_t begin = text.find("VAR\n") + 4;
  return text.substr(begin, text.find('\n', begin) - begin);
}

TEST(PlcopenXml, BecomesTheTextThatItSays) {
  const std::string xml = project(
      in_pou("<inputVars retain='true'><variable name='a' address='%IX0.0'><type><BOOL/></type>"
             "<documentation><xhtml:p>not read</xhtml:p></documentation></variable></inputVars>"
             "<outputVars/>"
             "<inOutVars><variable name='b'><type><derived name='Point'/></type></variable></inOutVars>"
             "<externalVars constant='true'><variable name='c'><type><REAL/></type></variable></externalVars>"
             "<tempVars><variable name='d'><type><TIME/></type></variable></tempVars>"
             "<localVars><variable name='e'><type><string length='80'/></type><initialValue>"
             "<simpleValue value='it&apos;s'/></initialValue></variable></localVars>",
             "<ST><xhtml:p><![CDATA[IF a < c THEN\n  d := T#1s;\nEND_IF;]]></xhtml:p></ST>"),
      "<task name='fast' interval='PT0.02S' priority='1'><pouInstance name='one' typeName='Main'/></task>"
      "<task name='edge' single='go' priority='0'><pouInstance name='two' typeName='Main'/></task>"
      "<pouInstance name='rest' typeName='Main'/>",
      "<globalVars><variable name='go'><type><BOOL/></type></variable></globalVars>");
  EXPECT_EQ(text_of(xml), R"(PROGRAM Main
VAR_INPUT RETAIN
a AT %IX0.0 : BOOL;
END_VAR
VAR_IN_OUT
b : Point;
END_VAR
VAR_EXTERNAL CONSTANT
c : REAL;
END_VAR
VAR_TEMP
d : TIME;
END_VAR
VAR
e : STRING[80] := 'it$'s';
END_VAR
IF a < c THEN
  d := T#1s;
END_IF;
END_PROGRAM
CONFIGURATION cell
VAR_GLOBAL
go : BOOL;
END_VAR
RESOURCE press ON PLC
TASK fast (INTERVAL := T#20ms, PRIORITY := 1);
TASK edge (SINGLE := go, PRIORITY := 0);
PROGRAM one WITH fast : Main;
PROGRAM two WITH edge : Main;
PROGRAM rest : Main;
END_RESOURCE
END_CONFIGURATION
)");
  const std::vector<iec::Source> sources{{"a.xml", read(xml).text.text()}};
  EXPECT_THAT(iec::read_project(sources).problems, IsEmpty());
}

TEST(PlcopenXml, HasTypesInTheWordsOfSt) {
  EXPECT_EQ(declared("<array><dimension lower='1' upper='3'/><dimension lower='-1' upper='MAX'/><baseType>"
                     "<string/></baseType></array>",
                     "<initialValue><arrayValue><value repetitionValue='2'><simpleValue value='x'/></value>"
                     "<value><simpleValue value=\"'y'\"/></value></arrayValue></initialValue>"),
            "a : ARRAY[1..3, -1..MAX] OF STRING := [2('x'), 'y'];");
  EXPECT_EQ(declared("<derived name='Point'/>",
                     "<initialValue><structValue><value member='x'><simpleValue value='1.5'/></value>"
                     "</structValue></initialValue>"),
            "a : Point := (x := 1.5);");
  EXPECT_EQ(
      declared("<subrangeSigned><range lower='-5' upper='5'/><baseType><INT/></baseType></subrangeSigned>"),
      "a : INT (-5..5);");
  EXPECT_EQ(declared("<wstring/>", "<initialValue><simpleValue value=''/></initialValue>"),
            "a : WSTRING := \"\";");
  const auto type = [](std::string_view base, std::string_view value = "") {
    return text_of(project(data_type(base, value) + "<pous/>"));
  };
  EXPECT_THAT(type("<struct>" + variable("<INT/>") + variable("<BOOL/>", "", "b") + "</struct>"),
              HasSubstr("TYPE\nT : STRUCT\na : INT;\nb : BOOL;\nEND_STRUCT;\nEND_TYPE\n"));
  EXPECT_THAT(type("<DINT/>", "<initialValue><simpleValue value='5'/></initialValue>"),
              HasSubstr("T : DINT := 5;"));
  EXPECT_THAT(type("<enum><values><value name='x' value='0'/><value name='y'/></values></enum>"),
              HasSubstr("T : (x, y);"));
  EXPECT_THAT(type("<enum><values><value name='x' value='3'/></values><baseType><INT/></baseType></enum>"),
              HasSubstr("T : (x := 3);"));
}

TEST(PlcopenXml, HasFunctionsAndFunctionBlocks) {
  const std::string body = "<body><ST><xhtml:p>;</xhtml:p></ST></body>";
  const std::string text = text_of(project(
      "<pous><pou name='F' pouType='function'><interface><returnType><INT/></returnType></interface>" + body +
      "</pou><pou name='B' pouType='functionBlock'><interface/>" + body + "</pou></pous>"));
  EXPECT_THAT(text, HasSubstr("FUNCTION F : INT\n" + std::string(kNoVariable) +
                              ";\nEND_FUNCTION\nFUNCTION_BLOCK B\n" + std::string(kNoVariable) +
                              ";\nEND_FUNCTION_BLOCK\n"));
}

// The configuration of CODESYS, as it exports it.
TEST(PlcopenXml, OfCodesysIsRead) {
  const std::string xml =
      R"(<project xmlns="http://www.plcopen.org/xml/tc6_0200"><types><dataTypes/><pous/></types>
<instances><configurations><configuration name="Device"><resource name="Application">
<task name="MainTask" interval="PT0.05S" priority="4"><pouInstance name="PLC_PRG" typeName=""/>
<addData><data name="http://www.3s-software.com/plcopenxml/tasksettings" handleUnknown="implementation">
<TaskSettings KindOfTask="Cyclic" Interval="50"><Watchdog Enabled="true"/></TaskSettings></data></addData></task>
<task name="Free" priority="5"><pouInstance name="Other" typeName="PLC_PRG"/>
<addData><data name="http://www.3s-software.com/plcopenxml/tasksettings" handleUnknown="implementation">
<TaskSettings KindOfTask="Freewheeling"/></data></addData></task>
<globalVars name="GVL"><variable name="a"><type><INT/></type></variable><variable name="b"><type><INT/></type></variable>
<addData><data name="http://www.3s-software.com/plcopenxml/mixedattrsvarlist" handleUnknown="implementation">
<MixedAttrsVarList><globalVars name="GVL" constant="true"><variable name="a"><type><INT/></type></variable></globalVars>
<globalVars name="GVL" persistent="true" retain="true"><variable name="b"><type><INT/></type></variable></globalVars>
</MixedAttrsVarList></data></addData></globalVars>
<addData><data name="http://www.3s-software.com/plcopenxml/pou" handleUnknown="implementation">
<pou name="PLC_PRG" pouType="program"><interface/><body><ST><xhtml xmlns="http://www.w3.org/1999/xhtml">x := 1;
y := 2;
</xhtml></ST></body><addData><data name="http://www.3s-software.com/plcopenxml/objectid" handleUnknown="discard">
<ObjectId>1</ObjectId></data></addData></pou></data></addData>
</resource></configuration></configurations></instances></project>)";
  const std::string text = text_of(xml);
  EXPECT_THAT(
      text, HasSubstr("PROGRAM PLC_PRG\n" + std::string(kNoVariable) + "x := 1;\ny := 2;\n\nEND_PROGRAM\n"));
  EXPECT_THAT(text,
              HasSubstr("VAR_GLOBAL CONSTANT\na : INT;\nEND_VAR\nVAR_GLOBAL RETAIN\nb : INT;\nEND_VAR\n"));
  EXPECT_THAT(text, HasSubstr("TASK MainTask (INTERVAL := T#50ms, PRIORITY := 4);\n"
                              "PROGRAM PLC_PRG_1 WITH MainTask : PLC_PRG;\nPROGRAM Other : PLC_PRG;\n"));
  std::vector<std::string> remarks;
  for (const auto& remark : read(xml).remarks) remarks.push_back(iec::describe(remark));
  EXPECT_THAT(
      remarks,
      ElementsAre("a.xml:12: resource Application: PERSISTENT is carried out as RETAIN; a cold reset "
                  "brings the initial values back",
                  "a.xml:3: task MainTask: its watchdog is not taken; a task file has watchdog_time",
                  "a.xml:6: task Free is freewheeling: each of its programs becomes a task of its own "
                  "name",
                  "a.xml:3: the instance of PLC_PRG is called PLC_PRG_1: ST cannot tell the two apart"));
}

TEST(PlcopenXml, IsRefusedWhereItsMeaningWouldBeLost) {
  const auto body = [](std::string_view text) { return problems_of(project(in_pou("", text))); };
  EXPECT_THAT(body("<FBD/>"), ElementsAre("a.xml:4: POU Main: its body is in FBD; only ST is taken"));
  EXPECT_THAT(body("<addData><data name='x'><CFC><a/></CFC></data></addData>"),
              ElementsAre("a.xml:4: POU Main: CFC is not taken: the compilers have no such thing",
                          "a.xml:4: POU Main: its body is in no language; ST is taken"));
  EXPECT_THAT(body("<ST><xhtml:img/></ST>"),
              ElementsAre("a.xml:4: POU Main: <img> is not understood in a body"));
  const auto interface = [](std::string_view text) { return problems_of(project(in_pou(text))); };
  EXPECT_THAT(interface("<globalVars/>").at(0),
              HasSubstr("POU Main: <globalVars> is not understood; allowed are localVars, tempVars, "));
  EXPECT_THAT(interface("<localVars>" + variable("<pointer/>") + "</localVars>").at(0),
              HasSubstr("POU Main: a: <pointer> is no type that can be taken; allowed are BOOL, "));
  EXPECT_THAT(interface("<localVars>" + variable("<INT/><INT/>") + "</localVars>"),
              ElementsAre("a.xml:4: POU Main: a: it has no type, or several"));
  EXPECT_THAT(interface("<localVars>" + variable("<INT/>", "", "a; END_VAR") + "</localVars>").at(0),
              HasSubstr("'a; END_VAR' is not allowed as its name; allowed are letters, digits and _"));
  EXPECT_THAT(interface("<localVars>" +
                        variable("<INT/>", "<initialValue><simpleValue value='1; b := 2'/></initialValue>") +
                        "</localVars>"),
              ElementsAre("a.xml:4: POU Main: a: '1; b := 2' is no value"));
  EXPECT_THAT(
      interface("<localVars><variable name='a' address='here'><type><INT/></type></variable></localVars>"),
      ElementsAre(HasSubstr("a: 'here' is no address; allowed are those like %IX0.0 and %QW1")));
  const auto pou = [](std::string_view rest, std::string_view kind = "program") {
    return problems_of(
        project(fmt::format("<pous><pou name='Main' pouType='{}'>{}</pou></pous>", kind, rest)));
  };
  EXPECT_THAT(pou(""),
              ElementsAre("a.xml:4: POU Main: it has no body; the export of a running instance has none"));
  EXPECT_THAT(pou("", "class").at(0), HasSubstr("pouType 'class' is not allowed; allowed are program, "));
  EXPECT_THAT(pou("<actions><action name='go'/></actions>").at(0),
              HasSubstr("POU Main: action go is not taken; only a body in ST is"));
  EXPECT_THAT(pou("<addData><data name='x'><Method name='m'><a/></Method></data></addData>").at(0),
              HasSubstr("POU Main: Method m is not taken: the compilers have no such thing"));
  const auto resource = [](std::string_view text) { return problems_of(project("<pous/>", text)); };
  EXPECT_THAT(
      resource("<task name='t' interval='often' priority='1'/>"),
      ElementsAre("a.xml:5: resource press: task t: interval 'often' is no duration; allowed are those "
                  "like T#20ms and PT0.02S"));
  EXPECT_THAT(resource("<task name='t' single='[a]' priority='x'/>"), SizeIs(2));
  EXPECT_THAT(problems_of(project("<pous/>", "", "<accessVars><accessVariable/></accessVars>")),
              ElementsAre("a.xml:5: configuration cell: <accessVars> is not taken"));
}

TEST(PlcopenXml, ThatIsNoneSaysWhy) {
  EXPECT_THAT(problems_of(""), ElementsAre(HasSubstr("a.xml:1: no XML: ")));
  EXPECT_THAT(problems_of("<project>\n<types></project>"), ElementsAre(HasSubstr("a.xml:2: no XML: ")));
  EXPECT_THAT(problems_of("<plc/>"),
              ElementsAre("a.xml:1: no project of PLCopen: its root is <plc>, not <project>"));
  EXPECT_THAT(problems_of("<project xmlns='urn:other'/>").at(0),
              HasSubstr("'urn:other' is not allowed as its name space; allowed are http://www.plcopen.org"));
  EXPECT_THAT(problems_of("<?xml version='1.0' encoding='latin1'?><project/>").at(0),
              HasSubstr("the encoding 'latin1' is not read; save it as UTF-8"));
  EXPECT_THAT(problems_of(std::string("<\0p", 3)),
              ElementsAre("a.xml: is no XML in UTF-8; save it as UTF-8"));
}

// Of the compiler, which sees the text that was made.
TEST(PlcopenXml, HasItsProblemsByTheLinesOfTheXml) {
  const std::string xml = project(in_pou("<localVars>\r\n" + variable("<INT/>") + "\r\n</localVars>",
                                         "\n<ST><xhtml:p><![CDATA[one;\n  two;]]></xhtml:p>\n<xhtml:p>three; "
                                         "&lt;&#10;four;\nfive;</xhtml:p></ST>"));
  StructuredText sut = read(xml);
  const auto line_of = [&](std::string_view word) {
    const std::string before = sut.text.text().substr(0, sut.text.text().find(word));
    return static_cast<unsigned>(1 + std::ranges::count(before, '\n'));
  };
  const auto told = [&](std::string_view word) {
    iec::SourceProblem problem{{"a.xml", line_of(word), 3}, "wrong"};
    sut.text.restore(problem);
    return iec::describe(problem);
  };
  EXPECT_EQ(told("a : INT"), "a.xml:5: wrong");
  EXPECT_EQ(told("one;"), "a.xml:7: Main, line 1 of its body, column 3: wrong");
  EXPECT_EQ(told("two;"), "a.xml:8: Main, line 2 of its body, column 3: wrong");
  EXPECT_EQ(told("three;"), "a.xml:9: Main, line 3 of its body, column 3: wrong");
  EXPECT_EQ(told("four;"), "a.xml:9: Main, line 4 of its body, column 3: wrong");
  EXPECT_EQ(told("five;"), "a.xml:10: Main, line 5 of its body, column 3: wrong");
  EXPECT_EQ(told("END_PROGRAM"), "a.xml:10: Main, line 5 of its body, column 3: wrong");
  EXPECT_EQ(told("TASK fast"), "a.xml:11: wrong");
  EXPECT_EQ(sut.text.line_in_xml(line_of("two;")), 8U);
  EXPECT_EQ(sut.text.line_in_xml(line_of("END_PROGRAM")), 10U);
  EXPECT_EQ(sut.text.line_of_xml(8), line_of("two;"));
  EXPECT_EQ(sut.text.line_of_xml(9), line_of("three;")) << "of several the first one";
  EXPECT_EQ(sut.text.line_of_xml(5), line_of("a : INT"));
  EXPECT_EQ(sut.text.line_of_xml(1), 1U) << "nothing of it stands there";
  iec::SourceProblem without_column{{"a.xml", line_of("two;"), 0}, "wrong"};
  sut.text.restore(without_column);
  EXPECT_EQ(iec::describe(without_column), "a.xml:8: Main, line 2 of its body: wrong");
  iec::SourceProblem of_the_file{{"a.xml", 0, 0}, "wrong"};
  sut.text.restore(of_the_file);
  EXPECT_EQ(iec::describe(of_the_file), "a.xml: wrong");
}

TEST(PlcopenXml, StaysWithinItsBounds) {
  const auto nested = [](int depth) {
    std::string type = "<INT/>";
    for (int i = 0; i < depth; ++i)
      type = fmt::format("<array><dimension lower='1' upper='2'/><baseType>{}</baseType></array>", type);
    return problems_of(project(in_pou("<localVars>" + variable(type) + "</localVars>")));
  };
  EXPECT_THAT(nested(kMostDepth), IsEmpty());
  EXPECT_THAT(nested(kMostDepth + 1), ElementsAre(HasSubstr("types are nested deeper than 16")));
  const auto unknown = [](std::size_t count) {
    std::string elements;
    for (std::size_t i = 0; i < count; ++i) elements += "<unknown/>";
    return problems_of(project(elements));
  };
  EXPECT_THAT(unknown(kMostProblems), SizeIs(kMostProblems));
  EXPECT_THAT(unknown(kMostProblems + 10), SizeIs(kMostProblems + 1));
  EXPECT_THAT(unknown(kMostProblems + 10).back(), HasSubstr("there are further problems"));
  const auto programs = [](std::size_t count) {
    std::string instances;
    for (std::size_t i = 0; i < count; ++i)
      instances += fmt::format("<pouInstance name='p{}' typeName='Main'/>", i);
    return problems_of(project("<pous/>", instances));
  };
  EXPECT_THAT(programs(kMostPrograms), IsEmpty());
  EXPECT_THAT(programs(kMostPrograms + 1),
              ElementsAre(HasSubstr("it has more than 1024 instances of programs")));
  // Entities of the file itself are not expanded, and a hundred thousand elements in each other are no stack.
  EXPECT_THAT(
      problems_of(
          "<!DOCTYPE project [<!ENTITY a 'b'><!ENTITY c '&a;&a;'>]>" +
          project(in_pou("<localVars><variable name='&c;'><type><INT/></type></variable></localVars>"))
              .substr(38))
          .at(0),
      HasSubstr("'&c;' is not allowed as its name"));
  std::string deep;
  for (int i = 0; i < 100'000; ++i) deep += "<a>";
  for (int i = 0; i < 100'000; ++i) deep += "</a>";
  EXPECT_THAT(problems_of(project(deep)), SizeIs(1));
}

TEST(IsoDuration, IsReadInNanoseconds) {
  EXPECT_EQ(iso_nanoseconds("PT0.02S"), 20'000'000);
  EXPECT_EQ(iso_nanoseconds("PT10S"), 10'000'000'000);
  EXPECT_EQ(iso_nanoseconds("P1DT2H3M4.5S"), 93'784'500'000'000);
  EXPECT_EQ(iso_nanoseconds("PT0,000001S"), 1'000);
  for (const char* wrong : {"", "P", "PT", "T1S", "P1Y", "P1M", "PT1S1M", "PT1", "PT-1S", "PT1SX", "1S",
                            "PT99999999999S", "P106752D"}) {
    EXPECT_EQ(iso_nanoseconds(wrong), std::nullopt) << wrong;
  }
  EXPECT_EQ(time_literal(20'000'000), "T#20ms");
  EXPECT_EQ(time_literal(1'500), "T#1500ns");
  EXPECT_EQ(time_literal(250'000), "T#250us");
}

}  // namespace
}  // namespace plchost::plcopen
