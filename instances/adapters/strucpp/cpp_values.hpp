#pragma once

#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "instances/adapters/iec/debug_pous.hpp"
#include "instances/adapters/iec/project.hpp"

namespace plchost::strucpp {

/// A variable in C++: "IEC_INT X = 3", "const IEC_STRING& TEXT".
struct CppVariable {
  std::string type;  ///< "IEC_INT", without const and &
  std::string name;

  /// Nothing: the text is something else.
  [[nodiscard]] static std::optional<CppVariable> parse(std::string_view text);
};

/// The types of the program, and what of a variable a debugger can see.
class CppValues {
 public:
  /// `header`: that STruC++ has written. `sources`: names are as they stand in them.
  CppValues(std::string_view header, std::span<const iec::Source> sources);

  /// Adds a variable that C++ calls `address`: a value, the fields of a structure, or nothing. `name`: for
  /// people. At most PLC_MAX_POU_LOCALS in all.
  void add(std::vector<iec::DebugLocal>& locals, const CppVariable& variable, const std::string& name) const;
  /// As the source writes it.
  [[nodiscard]] std::string name_in_source(const std::string& name) const;
  /// That of a class or structure, which may have an underscore behind its name; null: it has none.
  [[nodiscard]] const CppVariable* member(const std::string& type, const std::string& name) const;

 private:
  void read_line(std::string_view line);
  /// A part of a variable: an element of an array, a field of a structure.
  struct Part {
    std::string type;
    std::string name;
    std::string value;  ///< in C++
    std::vector<iec::DebugLocal::Dimension> dimensions = {};
  };
  void add(std::vector<iec::DebugLocal>& locals, const Part& part, std::size_t depth) const;
  void add_array(std::vector<iec::DebugLocal>& locals, const Part& array, std::size_t depth) const;

  std::map<std::string, std::string> aliases_;
  std::set<std::string> enumerations_;
  std::set<std::string> structures_;
  std::map<std::string, std::vector<CppVariable>> members_;  // also of classes
  std::map<std::string, std::string> names_;                 // by their folded names
  std::string in_;                                           // the class or structure that is read
};

}  // namespace plchost::strucpp
