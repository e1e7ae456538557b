#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>

namespace plchost::iec {

/// A Plc_Local: a variable that is on the stack, or that is no symbol.
struct DebugLocal {
  std::string name;
  std::string type;         ///< in C, PLC_TYPE_...
  std::string bytes;        ///< in C: of a string's memory; "0": of no string
  std::string address;      ///< in C, where the POU is entered
  unsigned first_line = 0;  ///< of the statements that it is there for; both 0: all
  unsigned last_line = 0;
  struct Dimension {
    std::int64_t first = 0;
    std::uint64_t count = 0;
    std::string stride;  ///< of its elements, in C, where all types of the program are known
  };
  std::vector<Dimension> dimensions = {};  ///< as many as its name has "[]"
};

/// Gives dimensions their strides, if the elements of the last one have so many bytes, in C.
template <class Dimension>
void give_strides(std::span<Dimension> dimensions, std::string_view bytes) {
  std::uint64_t elements = 1;
  for (std::size_t d = dimensions.size(); d-- > 0;) {
    dimensions[d].stride = fmt::format("{}u * {}", elements, bytes);
    elements *= dimensions[d].count;
  }
}
/// Whether an instance takes them.
[[nodiscard]] bool are_allowed(std::span<const DebugLocal::Dimension> dimensions) noexcept;

/// A POU of a debug build, as plc_debug.h describes it. Each has the variable plchost_pou_N in C.
struct DebugPou {
  std::string name;
  std::string file;
  std::vector<unsigned> lines;
  std::vector<DebugLocal> locals = {};
};

/// A program or function block with variables in it.
struct DebugInstance {
  std::size_t pou = 0;  ///< its number
  std::string value;    ///< in C, for `&`
  std::string path;     ///< that the names of its variables begin with: "Main.motor"
};

/// The file in which the variables of the POUs are.
inline constexpr std::string_view kDebugFile = "plchost_pous.h";

/// Its contents, in C and C++. A compiler's output behind it may use all names of plc_app.h that do not begin
/// with PLC_.
[[nodiscard]] std::string debug_header(std::span<const DebugPou> pous);
/// The first statement of the code of a POU. `self`: an expression. `locals`: those of this code, of which
/// the first has number `first` in its POU.
[[nodiscard]] std::string debug_enter(std::size_t pou, std::string_view self,
                                      std::span<const DebugLocal> locals = {}, std::size_t first = 0);
/// Goes before the statement of a line.
[[nodiscard]] std::string debug_statement(unsigned line);
/// The function plchost_declare_debugging(), behind all types of the program.
[[nodiscard]] std::string debug_declarations(std::span<const DebugPou> pous,
                                             std::span<const DebugInstance> instances);

}  // namespace plchost::iec
