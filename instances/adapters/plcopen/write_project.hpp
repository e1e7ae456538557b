#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace plchost::plcopen {

struct ExportedTask {
  enum class Kind : unsigned char { cyclic, event, external, freewheeling };
  std::string name;
  Kind kind = Kind::cyclic;
  int priority = 0;
  std::int64_t interval_ns = 0;  ///< of a cyclic one
  std::string event;             ///< the external event, or the variable of the edge; empty: not known
};

/// An instance of a program.
struct ExportedProgram {
  std::string name;
  std::string type;
  std::string task;  ///< empty: it runs without one
};

struct ExportedVariable {
  /// "MAIN.PUMP.HOURS" of a program or a structure, "MAIN.PUMP[1..4].HOURS" of an array of them; of a global
  /// "LIMIT".
  std::string path;
  std::string type;     ///< in ST: "INT", "ARRAY[1..3] OF INT", "STRING(80)", the name of another type
  std::string address;  ///< "%IX0.0"; another text is told in a documentation; empty: none
  bool retain = false;
  bool constant = false;
};

struct ExportedInstance {
  std::string name;
  std::vector<ExportedTask> tasks;
  std::vector<ExportedProgram> programs;    ///< empty: not known
  std::vector<ExportedVariable> variables;  ///< those in one structure, one behind the other
};

struct ExportedHost {
  std::string name;
  std::vector<ExportedInstance> instances;
};

struct ExportedPlant {
  std::string product_version;
  std::string time;  ///< of the export, as "2026-01-31T12:00:00"
  std::vector<ExportedHost> hosts;
};

/// For people, also in the file.
inline constexpr std::string_view kNotExported =
    "not exported, as a running instance does not tell it: bodies, initial values, functions, constants of "
    "MATIEC, temporary variables, VAR_IN_OUT and VAR_EXTERNAL; function blocks are structures of their "
    "variables";

/// PLCopen TC6 XML 2.01: each host is a configuration, each instance a resource. Bodies are not known, so
/// those of POUs have no statement. Names become those that ST allows; where they differ, a documentation
/// tells them.
[[nodiscard]] std::string project_of(const ExportedPlant& plant);

}  // namespace plchost::plcopen
