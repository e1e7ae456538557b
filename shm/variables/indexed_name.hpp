#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "shm/base/result.hpp"
#include "shm/variables/variable_symbol.hpp"

namespace plchost {

/// A name as people write it: of "Grid[1, 2].x" and "Grid[1][2].x" the canonical one is "Grid[][].x".
struct IndexedName {
  std::string canonical;
  std::vector<std::optional<std::int64_t>> indexes;  ///< nothing: each one
  /// invalid_argument: an index is none.
  [[nodiscard]] static Result<IndexedName> parse(std::string_view name);
};
/// The number of the element that a name means, which is canonically that of the symbol. invalid_argument: an
/// index is missing or out of its range; says what is allowed.
[[nodiscard]] Result<std::uint32_t> element_number(const VariableSymbol& symbol, const IndexedName& indexed);
/// Whether two names differ in no more than brackets.
[[nodiscard]] bool same_without_brackets(std::string_view left, std::string_view right) noexcept;
/// invalid_argument: `name` means that symbol, but says elements of no array, or none of an array.
[[nodiscard]] Error other_dimensions(std::string_view name, const VariableSymbol& symbol);

}  // namespace plchost
