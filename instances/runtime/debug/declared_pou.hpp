#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "instances/plc_debug.h"
#include "shm/base/result.hpp"
#include "shm/variables/variable_symbol.hpp"

namespace plchost {

/// A variable of each call of a POU: see Plc_Local.
struct DeclaredLocal {
  VariableSymbol symbol;
  std::vector<std::uint32_t> strides = {};  ///< of its dimensions, in bytes
  std::uint32_t first_line = 0;
  std::uint32_t last_line = 0;

  [[nodiscard]] bool is_at(std::uint32_t line) const noexcept {
    return last_line == 0 || (first_line <= line && line <= last_line);
  }
  /// Of an element, from the first one on.
  [[nodiscard]] std::uint32_t offset(std::uint32_t element) const noexcept;
  [[nodiscard]] std::uint32_t reach() const noexcept {
    return last_line == 0 ? std::numeric_limits<std::uint32_t>::max() : last_line - first_line;
  }
};

/// The value that a name means: a local variable, or an element of one.
struct LocalElement {
  std::uint32_t local = 0;   ///< its number
  std::uint32_t offset = 0;  ///< of the element, in bytes
  bool operator==(const LocalElement&) const = default;
};

/// A program, function block or function that a debug build has declared.
struct DeclaredPou {
  std::string name;
  std::string file;
  std::vector<std::uint32_t> lines;        ///< ascending
  std::vector<DeclaredLocal> locals = {};  ///< each at its number

  /// The first line with a statement that is not before `line`; nothing: there is none.
  [[nodiscard]] std::optional<std::uint32_t> line_from(std::uint32_t line) const noexcept;
  /// The local variable that a name means at a statement; nothing: none. Several methods may have one of that
  /// name. invalid_argument: it is an array and the name says no element of it, or it is none.
  [[nodiscard]] Result<std::optional<LocalElement>> local(std::string_view name, std::uint32_t line) const;
  /// The same at the statement of a call, of those that it has.
  [[nodiscard]] Result<std::optional<LocalElement>> local(std::string_view name,
                                                          const Plc_Frame& frame) const;
};

/// A POU, and a line of it with a statement.
struct PouLine {
  std::uint32_t pou = 0;
  std::uint32_t line = 0;
  bool operator==(const PouLine&) const = default;
};

/// The POUs and instances that a debug build declares; empty: it is none. Control thread; the log has the
/// reason of a refusal.
class PouCollection {
 public:
  [[nodiscard]] RTS_RESULT declare(Plc_Pou* pou);
  [[nodiscard]] RTS_RESULT declare_instance(const Plc_Pou* pou, const void* self, const char* path);

  /// Each at its number.
  [[nodiscard]] std::span<const DeclaredPou> pous() const noexcept { return pous_; }
  /// Where the variables of an instance are called so; empty: it was not declared.
  [[nodiscard]] std::string_view path_of(std::uint32_t pou, const void* self) const noexcept;
  struct PouInstance {
    const void* self = nullptr;
    std::string path;
  };
  /// All that are declared of that POU.
  [[nodiscard]] std::vector<PouInstance> instances_of(std::uint32_t pou) const;

  /// The statement at or behind a place: "POU:LINE", "FILE:LINE", or "POU", its first one. The file may be
  /// given by the last parts of its path. Of a whole path the file counts that has most last parts of it, at
  /// least its name. not_found: there is no such POU or file, or no statement from that line
  /// on; the text lists what there is. invalid_argument: it is no place.
  [[nodiscard]] Result<PouLine> find(std::string_view place) const;

 private:
  [[nodiscard]] Result<PouLine> find_in_file(std::string_view file, std::uint32_t line) const;

  std::vector<DeclaredPou> pous_;
  std::map<std::pair<std::uint32_t, const void*>, std::string> instances_;
};

}  // namespace plchost
