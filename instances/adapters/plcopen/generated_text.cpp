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

void GeneratedText::restore(iec::SourceProblem& problem) const {
  if (problem.place.line == 0 || origins_.empty()) return;
  const Origin& origin = origins_[std::min<std::size_t>(problem.place.line, origins_.size()) - 1];
  if (origin.body_line != 0) {
    const std::string column =
        problem.place.column == 0 ? "" : fmt::format(", column {}", problem.place.column);
    problem.text = fmt::format("{}, line {} of its body{}: {}", pous_[origin.pou], origin.body_line, column,
                               problem.text);
  }
  problem.place = {problem.place.file, origin.xml_line, 0};
}

}  // namespace plchost::plcopen
