#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <string>
#include <string_view>

#include "instances/adapters/iec/project.hpp"
#include "instances/adapters/plcopen/project_file.hpp"
#include "instances/adapters/plcopen/structured_text.hpp"

namespace {

using namespace plchost;

constexpr std::string_view kBegin = "<project xmlns='http://www.plcopen.org/xml/tc6_0201'>";

/// Bytes alone seldom make an element. The elements that are open are closed at the end.
constexpr std::array<std::string_view, 58> kElements{"types",
                                                     "dataTypes",
                                                     "dataType name='T'",
                                                     "baseType",
                                                     "struct",
                                                     "enum",
                                                     "values",
                                                     "value name='v'",
                                                     "pous",
                                                     "pou name='P' pouType='program'",
                                                     "pou name='F' pouType='function'",
                                                     "interface",
                                                     "returnType",
                                                     "localVars",
                                                     "inputVars retain='true'",
                                                     "outputVars",
                                                     "inOutVars",
                                                     "externalVars",
                                                     "tempVars",
                                                     "globalVars constant='1'",
                                                     "variable name='a'",
                                                     "variable name='b' address='%IX0.1'",
                                                     "type",
                                                     "INT",
                                                     "BOOL",
                                                     "string length='3'",
                                                     "wstring",
                                                     "array",
                                                     "dimension lower='1' upper='2'",
                                                     "derived name='T'",
                                                     "subrangeSigned",
                                                     "range lower='0' upper='9'",
                                                     "initialValue",
                                                     "simpleValue value='1'",
                                                     "simpleValue value='a'",
                                                     "arrayValue",
                                                     "value repetitionValue='2'",
                                                     "structValue",
                                                     "value member='a'",
                                                     "body",
                                                     "ST",
                                                     "p",
                                                     "FBD",
                                                     "actions",
                                                     "action name='x'",
                                                     "transitions",
                                                     "instances",
                                                     "configurations",
                                                     "configuration name='C'",
                                                     "resource name='R'",
                                                     "task name='t' interval='PT1S' priority='1'",
                                                     "task name='u' single='a' priority='0'",
                                                     "pouInstance name='i' typeName='P'",
                                                     "pouInstance name='P' typeName=''",
                                                     "addData",
                                                     "data name='d'",
                                                     "MixedAttrsVarList",
                                                     "TaskSettings KindOfTask='Freewheeling'"};
constexpr std::uint8_t kClose = kElements.size();
constexpr std::uint8_t kCharacterData = kClose + 1;

void close(std::string& text, std::string_view element) {
  text += "</";
  text += element.substr(0, element.find(' '));
  text += ">";
}

std::string text_of(const std::uint8_t* data, std::size_t size) {
  std::string text(kBegin);
  std::string open;  // the elements, as bytes
  for (const std::uint8_t byte : std::span(data, size)) {
    if (byte < kElements.size()) {
      text += "<" + std::string(kElements.at(byte)) + ">";
      open += static_cast<char>(byte);
    } else if (byte == kClose && !open.empty()) {
      close(text, kElements.at(static_cast<std::uint8_t>(open.back())));
      open.pop_back();
    } else if (byte == kCharacterData) {
      text += "<![CDATA[a := 1;\n]]>";
    } else {
      text += static_cast<char>(byte);
    }
  }
  for (; !open.empty(); open.pop_back()) close(text, kElements.at(static_cast<std::uint8_t>(open.back())));
  return text + "</project>";
}

void require_places(const iec::SourceProblems& problems, std::size_t lines) {
  if (problems.size() > plcopen::kMostProblems + 1) std::abort();
  for (const iec::SourceProblem& problem : problems) {
    if (problem.place.file != "a.xml" || problem.place.line > lines || problem.text.empty()) std::abort();
  }
}

// Problems, and what the next reader says of the text, have lines of the XML.
void read(const std::string& xml) {
  const std::size_t lines =
      1 + static_cast<std::size_t>(std::ranges::count_if(xml, [](char c) { return c == '\n' || c == '\r'; }));
  plcopen::ProjectSources projects;
  iec::SourceProblems problems;
  const std::array<iec::Source, 1> sources{projects.take({"a.xml", xml}, problems)};
  require_places(problems, lines);
  auto [project, later] = iec::read_project(sources);
  for (iec::Configuration& configuration : project.configurations) projects.add_events(configuration);
  iec::SourceProblems remarks;
  if (!problems.empty()) return;
  projects.restore(later, remarks);
  require_places(remarks, lines);
  for (const iec::SourceProblem& problem : later) {
    if (problem.place.line == 0 || problem.place.line > lines) std::abort();
  }
}

}  // namespace

// Any text comes to an end, within bounds.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  read(std::string(reinterpret_cast<const char*>(data), size));
  read(text_of(data, size));
  return 0;
}
