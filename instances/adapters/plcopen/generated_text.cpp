#include "instances/adapters/plcopen/generated_text.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace plchost::plcopen {

void GeneratedText::add(std::string_view line, unsigned xml_line) {
  text_ += line;
  text_ += '\n';
  origins_.push_back({.xml_line = xml_line});
}

void GeneratedText::add_body(const std::vector<BodyLine>& lines, const std::string& pou) {
  pous_.push_back(pou);
  unsigned number = 0;
  for (const BodyLine& line : lines) {
    add(line.text, line.line);
    origins_.back().body_line = ++number;
    origins_.back().pou = pous_.size() - 1;
  }
}

void GeneratedText::end_body(std::string_view line) {
  const Origin last = origins_.back();
  add(line, last.xml_line);
  origins_.back() = last;
}

const GeneratedText::Origin& GeneratedText::origin_of(unsigned line) const noexcept {
  return origins_[std::clamp<std::size_t>(line, 1, origins_.size()) - 1];
}

unsigned GeneratedText::line_in_xml(unsigned line) const noexcept {
  return origins_.empty() ? line : origin_of(line).xml_line;
}

unsigned GeneratedText::line_of_xml(unsigned xml_line) const noexcept {
  const auto stands_there = [&](const Origin& origin) { return origin.xml_line == xml_line; };
  auto found = std::ranges::find_if(
      origins_, [&](const Origin& origin) { return stands_there(origin) && origin.body_line != 0; });
  if (found == origins_.end()) found = std::ranges::find_if(origins_, stands_there);
  return found == origins_.end() ? xml_line : static_cast<unsigned>(found - origins_.begin()) + 1;
}

void GeneratedText::restore(iec::SourceProblem& problem) const {
  if (problem.place.line == 0 || origins_.empty()) return;
  const Origin& origin = origin_of(problem.place.line);
  if (origin.body_line != 0) {
    const std::string column =
        problem.place.column == 0 ? "" : fmt::format(", column {}", problem.place.column);
    problem.text = fmt::format("{}, line {} of its body{}: {}", pous_[origin.pou], origin.body_line, column,
                               problem.text);
  }
  problem.place = {problem.place.file, origin.xml_line, 0};
}

}  // namespace plchost::plcopen
