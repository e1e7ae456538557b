#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "api/dds/variable_page.hpp"
#include "shm/base/result.hpp"
#include "shm/variables/symbol_page.hpp"
#include "shm/variables/value_message.hpp"

namespace plchost {

/// A row of a page: a variable, or one element of it.
struct SelectedVariable {
  std::uint32_t symbol = 0;
  std::optional<std::uint32_t> element;  ///< nothing: the whole variable
  std::size_t first = 0;                 ///< of its values, among those that are asked for
  std::size_t count = 0;
};

/// The part of a table that one page shows.
struct VariableSelection {
  std::vector<SelectedVariable> rows;
  std::vector<VariableElement> elements;  ///< the rows need their values
  bool complete = true;
  std::uint64_t next_after = 0;
};

/// Of a whole array so many elements are shown.
inline constexpr std::size_t kShownElements = 64;

/// The next page of what the query names: at most kPageVariables rows, and as many as fit into a sample and
/// into one request for values. not_found: a name without '*' and '?' that is no variable; invalid_argument:
/// more than kMaxWildcards patterns with one, an index that is none.
[[nodiscard]] Result<VariableSelection> select_variables(const SymbolTable& table,
                                                         const VariableQuery& query);
inline constexpr std::size_t kMaxWildcards = 16;

/// The next page of the elements that are forced, as the instance names them, and that the query names.
[[nodiscard]] Result<VariableSelection> select_forced(const SymbolTable& table, const VariableQuery& query,
                                                      std::span<const VariableElement> forced);

/// The rows as they travel. `current` has the values of all elements of the selection, `forced` of all that
/// are forced, or none.
[[nodiscard]] std::vector<plc_VariableRecord> records_of(const SymbolTable& table,
                                                         const VariableSelection& selection,
                                                         const ValueReply& current, const ValueReply& forced);

}  // namespace plchost
