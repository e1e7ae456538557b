#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "instances/adapters/iec/location_options.hpp"
#include "instances/adapters/iec/source_place.hpp"
#include "instances/adapters/iec/task_extension.hpp"

namespace plchost::iec {

/// Types within types and function blocks within function blocks, in levels. Deeper levels are not looked at.
inline constexpr std::size_t kMostNested = 32;

// The declarations in the sources of a program, as far as tasks, areas and variables need them. The compiler
// reads the sources, too, and finds what is wrong in the rest. Names are as they stand in the source; compare
// them by folded().

/// The types of variables with references begin so.
inline constexpr std::string_view kReference = "REFERENCE ";

struct Variable {
  enum class Section : unsigned char { input, output, in_out, local, temporary, external, global, other };
  std::string name;
  /// "INT", "ARRAY[1..3] OF INT", "STRING(80)": the words of the source, one blank apart. Behind kReference,
  /// if its values have references.
  std::string type;
  std::string location;  ///< "%IX0.0"; empty: none
  Section section = Section::local;
  bool retain = false;
  bool constant = false;
  SourcePlace place;
  std::string member = {};  ///< its name in the output of STruC++; empty: its own, folded
  std::string value = {};   ///< of a constant: the words of its initial value, without blanks
};

struct Pou {
  enum class Kind : unsigned char { program, function_block, function };
  Kind kind = Kind::program;
  std::string name;
  std::vector<Variable> variables;
  /// The steps, transitions and actions of a sequential function chart, by name and in their order. Empty: it
  /// is none.
  std::string chart;
  SourcePlace place;
  SourcePlace name_place = {};
  std::string result = {};  ///< the type of a function
};

struct Task {
  std::string name;
  std::optional<std::int64_t> interval_ns;  ///< none, or 0 in the source: not cyclic
  std::string single;                       ///< the variable whose rising edge releases it; empty: none
  int priority = 0;                         ///< 0 is the highest
  SourcePlace place;
  TaskExtension extension = {};
};

/// An instance of a program.
struct Program {
  std::string name;
  std::string type;
  std::string task;        ///< empty: it runs without one
  bool connected = false;  ///< variables stand in parentheses behind its type
  bool retain = false;     ///< all its variables are retained
  SourcePlace place;
  bool copies_globals = false;   ///< each of its cycles sees one value of each global
  TaskExtension extension = {};  ///< of its own task, if it runs without one
};

/// A type that is declared in TYPE ... END_TYPE.
struct DeclaredType {
  std::string name;
  std::string definition;  ///< its words, folded, one blank apart
  SourcePlace place;
};

struct Resource {
  std::string name;
  std::vector<Variable> globals;
  std::vector<Task> tasks;
  std::vector<Program> programs;
  SourcePlace place;
  std::string scheduler = {};  ///< that its tasks are made for; empty: any
};

struct Configuration {
  std::string name;
  std::vector<Variable> globals;
  std::vector<Resource> resources;  ///< one without a name, if tasks stand in the configuration itself
  SourcePlace place;
  LocationOptions locations = {};
};

class Project {
 public:
  std::vector<Pou> pous;
  std::vector<DeclaredType> types;
  std::vector<Configuration> configurations;
  std::map<std::string, SourcePlace> locations;  ///< each %... in the sources, folded, where it stands first
  std::vector<SourcePlace> persistent;           ///< each PERSISTENT: no compiler knows the word

  /// The first one of this name.
  [[nodiscard]] const Pou* pou(std::string_view name) const;
  void add(Pou pou);

 private:
  std::map<std::string, std::size_t> numbers_;  // of POUs, by their folded name
};

struct Source {
  std::string file;  ///< for messages
  std::string text;
};

struct ReadProject {
  Project project;
  SourceProblems problems;  ///< of tasks and declarations; those of a body are the compiler's
};

/// Any text, hostile ones included: bounded depth.
[[nodiscard]] ReadProject read_project(std::span<const Source> sources);

}  // namespace plchost::iec
