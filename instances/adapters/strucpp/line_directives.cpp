#include "instances/adapters/strucpp/line_directives.hpp"

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <vector>

#include <fmt/format.h>

namespace plchost::strucpp {

namespace {

constexpr std::string_view kDirective = "#line ";

std::string_view first_word(std::string_view text) {
  return text.substr(0, text.find_first_of(" :{"));
}

// The POU whose code begins in such a line: "class Program_MAIN : public ProgramBase {",
// "void COUNTER::operator()() {", "IEC_INT TWICE(IEC_INT X) {", "IEC_INT TWICE(IEC_INT X);"; empty: none
// does.
std::string_view pou_that_begins(std::string_view line) {
  if (line.empty() || line.front() == ' ' || !(line.ends_with('{') || line.ends_with(");"))) return {};
  std::string_view name;
  if (constexpr std::string_view kClass = "class "; line.starts_with(kClass)) {
    name = first_word(line.substr(kClass.size()));
  } else {
    name = line.substr(0, line.find('('));
    if (name.size() == line.size()) return {};
    name.remove_prefix(name.find_last_of(' ') + 1);
    name = name.substr(0, name.find("::"));
  }
  if (constexpr std::string_view kProgram = "Program_"; name.starts_with(kProgram))
    name.remove_prefix(kProgram.size());
  return name;
}

// #line N "FILE", with that file, else its own.
std::string renewed(std::string_view directive, const std::optional<std::string>& file,
                    const iec::FindLine& find_line) {
  unsigned line = 0;
  const char* const end = directive.data() + directive.size();
  const bool has_line =
      std::from_chars(directive.data() + kDirective.size(), end, line).ec == std::errc() && line != 0;
  const std::size_t begin = directive.find('"');
  if (!has_line || (!file && begin == std::string_view::npos)) return fmt::format("{}\n", directive);
  const std::string_view own = begin == std::string_view::npos ? "" : directive.substr(begin + 1);
  const std::string name = file ? *file : std::string(own.substr(0, own.find('"')));
  return fmt::format("{}{} \"{}\"\n", kDirective, find_line(name, line), name);
}

}  // namespace

std::string with_files_of_pous(std::string_view code, const FindFile& find_file,
                               const iec::FindLine& find_line) {
  std::string made;
  std::optional<std::string> file;
  std::vector<std::string_view> directives;  // the head of a POU comes behind its own
  while (!code.empty()) {
    const std::size_t end = std::min(code.find('\n'), code.size());
    const std::string_view line = code.substr(0, end);
    const bool has_end = end < code.size();
    code.remove_prefix(has_end ? end + 1 : end);
    if (line.starts_with(kDirective) && has_end) {
      directives.push_back(line);
      continue;
    }
    if (const std::string_view pou = pou_that_begins(line); !pou.empty()) {
      if (auto found = find_file(pou)) file = *std::move(found);
    }
    for (const std::string_view directive : directives) made += renewed(directive, file, find_line);
    directives.clear();
    made += line;
    if (has_end) made += '\n';
  }
  for (const std::string_view directive : directives) made += fmt::format("{}\n", directive);
  return made;
}

}  // namespace plchost::strucpp
