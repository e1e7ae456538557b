#include "instances/adapters/plcopen/structured_text.hpp"

#include <algorithm>
#include <iterator>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <pugixml.hpp>

#include "instances/adapters/iec/tokens.hpp"
#include "instances/adapters/plcopen/instances_part.hpp"
#include "instances/adapters/plcopen/pous.hpp"
#include "instances/adapters/plcopen/project_file.hpp"

namespace plchost::plcopen {

namespace {

using pugi::xml_node;

/// CODESYS writes the POUs of an application into its resource.
void add_types_of_resources(ProjectFile& file, const xml_node& configurations, GeneratedText& text) {
  for (const xml_node& resource : configurations.children()) {
    for (const xml_node& added : resource.child("addData").children()) {
      for (const xml_node& part : added.children()) {
        if (file.name_of(part) == "pou") add_pou(file, part, text);
        if (file.name_of(part) == "dataType") add_data_type(file, part, text);
      }
    }
  }
}

void add_project(ProjectFile& file, GeneratedText& text) {
  const auto pou = [&](const xml_node& one) { add_pou(file, one, text); };
  const auto data_type = [&](const xml_node& one) { add_data_type(file, one, text); };
  const auto types = [&](const xml_node& one) {
    file.read(one, "types",
              {{"dataTypes",
                [&](const xml_node& list) { file.read(list, "dataTypes", {{"dataType", data_type}}); }},
               {"pous", [&](const xml_node& list) { file.read(list, "pous", {{"pou", pou}}); }}});
  };
  const auto configuration = [&](const xml_node& one) {
    add_types_of_resources(file, one, text);
    add_configuration(file, one, text);
  };
  const auto instances = [&](const xml_node& one) {
    file.read(one, "instances", {{"configurations", [&](const xml_node& list) {
                                    file.read(list, "configurations", {{"configuration", configuration}});
                                  }}});
  };
  const auto nothing = [](const xml_node&) {};
  file.read(file.project(), "project",
            {{"types", types},
             {"instances", instances},
             {"fileHeader", nothing},
             {"contentHeader", nothing},
             {"pou", pou},
             {"dataType", data_type}});
}

}  // namespace

bool is_project_file(std::string_view name) {
  return iec::folded(name).ends_with(".XML");
}

StructuredText structured_text_of(const iec::Source& xml) {
  ProjectFile file(xml.text, xml.file);
  StructuredText result;
  if (file.project()) add_project(file, result.text);
  result.problems = file.problems();
  result.remarks = file.remarks();
  return result;
}

iec::Source ProjectSources::take(const iec::Source& xml, iec::SourceProblems& problems) {
  StructuredText read = structured_text_of(xml);
  std::ranges::move(read.remarks, std::back_inserter(remarks_));
  iec::Source source{.file = xml.file, .text = read.text.text()};
  // With a problem the build ends before anybody reads the ST.
  if (read.problems.empty()) texts_.emplace_back(xml.file, std::move(read.text));
  std::ranges::move(read.problems, std::back_inserter(problems));
  return source;
}

namespace {

// The length in "STRING[80]": all else stays where it is. False: there is none.
bool change_lengths(std::string& text, iec::Compiler compiler) {
  bool found = false;
  const std::vector<iec::Token> tokens = iec::tokens_of(text, "").all;
  for (std::size_t i = 0; i + 3 < tokens.size(); ++i) {
    const bool is_text = tokens[i].is("STRING") || tokens[i].is("WSTRING");
    if (!is_text || !tokens[i + 1].is("[")) continue;
    const auto end = std::find_if(tokens.begin() + static_cast<std::ptrdiff_t>(i), tokens.end(),
                                  [](const iec::Token& token) { return token.is("]"); });
    if (end == tokens.end()) break;
    found = true;
    const std::size_t begin = tokens[i + 1].offset;
    if (compiler == iec::Compiler::strucpp) {
      text[begin] = '(';
      text[end->offset] = ')';
    } else {
      text.replace(begin, end->offset + 1 - begin, end->offset + 1 - begin, ' ');
    }
  }
  return found;
}

}  // namespace

// They are generated in brackets.
void ProjectSources::fit_lengths(std::vector<iec::Source>& sources, iec::Compiler compiler) {
  for (iec::Source& source : sources) {
    const auto text = std::ranges::find(texts_, source.file, &decltype(texts_)::value_type::first);
    if (text == texts_.end() || !change_lengths(source.text, compiler)) continue;
    if (compiler == iec::Compiler::matiec) {
      remarks_.push_back({{source.file, 0, 0},
                          "the lengths of its texts are not taken: MATIEC gives each text 126 characters"});
    }
  }
}

void ProjectSources::add_events(iec::Configuration& configuration) const {
  for (const auto& [file, text] : texts_) {
    for (const TaskEvent& one : text.events()) {
      for (iec::Resource& resource : configuration.resources) {
        if (iec::folded(resource.name) != iec::folded(one.resource)) continue;
        const auto task = std::ranges::find(resource.tasks, iec::folded(one.task),
                                            [](const iec::Task& known) { return iec::folded(known.name); });
        if (task == resource.tasks.end() || !task->extension.external_event.empty()) continue;
        task->extension.external_event = one.event;
      }
    }
  }
}

void ProjectSources::restore(iec::SourceProblems& problems, iec::SourceProblems& remarks) const {
  for (auto* const told : {&problems, &remarks}) {
    for (iec::SourceProblem& problem : *told) {
      if (const GeneratedText* const text = text_of(problem.place.file)) text->restore(problem);
    }
  }
  std::ranges::copy(remarks_, std::back_inserter(remarks));
}

const GeneratedText* ProjectSources::text_of(std::string_view file) const noexcept {
  const auto text = std::ranges::find(texts_, file, &decltype(texts_)::value_type::first);
  return text == texts_.end() ? nullptr : &text->second;
}

unsigned ProjectSources::line_in_file(std::string_view file, unsigned line) const noexcept {
  const GeneratedText* const text = text_of(file);
  return text == nullptr ? line : text->line_in_xml(line);
}

unsigned ProjectSources::line_in_source(std::string_view file, unsigned line) const noexcept {
  const GeneratedText* const text = text_of(file);
  return text == nullptr ? line : text->line_of_xml(line);
}

}  // namespace plchost::plcopen
