#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "instances/plc_debug.h"
#include "shm/base/result.hpp"

namespace plchost {

/// A program, function block or function that a debug build has declared.
struct DeclaredPou {
  std::string name;
  std::string file;
  std::vector<std::uint32_t> lines;  ///< ascending

  /// The first line with a statement that is not before `line`; nothing: there is none.
  [[nodiscard]] std::optional<std::uint32_t> line_from(std::uint32_t line) const noexcept;
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
  /// given by its last name alone. not_found: there is no such POU or file, or no statement from that line
  /// on; the text lists what there is. invalid_argument: it is no place.
  [[nodiscard]] Result<PouLine> find(std::string_view place) const;

 private:
  [[nodiscard]] Result<PouLine> find_in_file(std::string_view file, std::uint32_t line) const;

  std::vector<DeclaredPou> pous_;
  std::map<std::pair<std::uint32_t, const void*>, std::string> instances_;
};

}  // namespace plchost
