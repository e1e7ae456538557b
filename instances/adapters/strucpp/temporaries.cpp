#include "instances/adapters/strucpp/temporaries.hpp"

#include <algorithm>
#include <cstddef>
#include <map>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "instances/adapters/iec/c_texts.hpp"

namespace plchost::strucpp {

namespace {

/// The initial values of members, by their name: "    : A(1), TEXT("x, y")".
std::map<std::string, std::string, std::less<>> initial_values(std::string_view list) {
  std::map<std::string, std::string, std::less<>> values;
  std::size_t begin = list.find(": ");
  for (begin = begin == std::string_view::npos ? list.size() : begin + 2; begin < list.size();) {
    const std::size_t open = list.find('(', begin);
    if (open == std::string_view::npos) break;
    const std::size_t end = iec::find_close(list, open);
    if (end == std::string_view::npos) break;
    values.emplace(list.substr(begin, open - begin), list.substr(open + 1, end - open - 1));
    begin = std::min(list.find_first_not_of(", \n", end + 1), list.size());
  }
  return values;
}

/// The class of "void COUNTER::operator()() {" and "void Program_MAIN::run() {".
std::optional<std::string_view> class_of_body(std::string_view line) {
  constexpr std::string_view kVoid = "void ";
  if (!line.starts_with(kVoid)) return std::nullopt;
  line.remove_prefix(kVoid.size());
  for (const std::string_view end : {"::operator()() {", "::run() {"}) {
    if (line.ends_with(end)) return line.substr(0, line.size() - end.size());
  }
  return std::nullopt;
}

/// The class of "COUNTER::COUNTER()", and of "Program_MAIN::Program_MAIN(GlobalVar<IEC_INT>* G_ref)", which
/// has external variables.
std::optional<std::string_view> class_of_constructor(std::string_view line) {
  const std::string_view name = line.substr(0, line.find("::"));
  if (name.empty() || !line.starts_with(fmt::format("{0}::{0}(", name)) || !line.ends_with(')'))
    return std::nullopt;
  return name;
}

/// The initial values of a constructor, in the code behind its first line. Without any, its body begins
/// there.
std::string_view list_at(std::string_view code) {
  return code.starts_with("    : ") ? code.substr(0, code.find("\n{")) : std::string_view();
}

const iec::Pou* pou_of(const iec::Project& project, std::string_view type) {
  constexpr std::string_view kPrefix = "Program_";
  if (type.starts_with(kPrefix)) type.remove_prefix(kPrefix.size());
  return project.pou(type);
}

class Renewer {
 public:
  explicit Renewer(const iec::Project& project) : project_(project) {}

  std::string run(std::string_view code) {
    std::string made;
    while (!code.empty()) {
      const std::size_t end = std::min(code.find('\n'), code.size() - 1);
      std::string_view line = code.substr(0, end + 1);
      code.remove_prefix(line.size());
      made += line;
      if (line.ends_with('\n')) line.remove_suffix(1);
      if (const auto type = class_of_constructor(line)) {
        values_[std::string(*type)] = initial_values(list_at(code));
      } else if (const auto body = class_of_body(line)) {
        const bool has_end = made.ends_with('\n');
        if (has_end) made.pop_back();
        made += renewals_of(*body);
        if (has_end) made += '\n';
      }
    }
    return made;
  }

 private:
  [[nodiscard]] std::string renewals_of(std::string_view type) const {
    std::string made;
    const iec::Pou* const pou = pou_of(project_, type);
    if (pou == nullptr) return made;
    for (const iec::Variable& variable : pou->variables) {
      if (variable.section != iec::Variable::Section::temporary || variable.constant ||
          variable.member.empty())
        continue;
      made += fmt::format(" plchost_renew({}{});", variable.member, initial_of(type, variable.member));
    }
    return made;
  }
  // ", 5", if it has one.
  [[nodiscard]] std::string initial_of(std::string_view type, std::string_view member) const {
    const auto values = values_.find(type);
    if (values == values_.end()) return "";
    const auto value = values->second.find(member);
    return value == values->second.end() ? "" : ", " + value->second;
  }

  const iec::Project& project_;
  std::map<std::string, std::map<std::string, std::string, std::less<>>, std::less<>> values_;
};

}  // namespace

std::string with_new_temporaries(std::string_view code, const iec::Project& project) {
  return Renewer(project).run(code);
}

}  // namespace plchost::strucpp
