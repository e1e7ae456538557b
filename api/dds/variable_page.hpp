#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <contract_bounds.hpp>
#include <control.h>

#include "api/dds/kept_record.hpp"
#include "api/dds/page_sample.hpp"
#include "shm/base/result.hpp"

namespace plchost {

/// Which variables of an instance are asked for.
struct VariableQuery {
  std::vector<std::string> patterns = {};  ///< like one of these, as SymbolTable::match() has it; none: all
  bool forced = false;                     ///< only elements that are forced
  std::uint64_t after = 0;                 ///< VariableListing::next_after of the page before
};

/// The query as it travels. invalid_argument: the patterns are longer than a request has room for, or one of
/// them is empty or has a line end.
[[nodiscard]] Result<plc_ListPart> part_of(const VariableQuery& query);
[[nodiscard]] VariableQuery variable_query_of(const plc_ListPart& part);

/// Variables with their values of one moment.
template <class Record>
struct VariablesOfOneMoment {
  std::uint64_t stream = 0;  ///< of the table of variables; another one: `after` means something else
  std::int64_t time_unix_ns = 0;
  std::int64_t time_monotonic_ns = 0;  ///< of the host
  bool consistent = true;              ///< no task was within a cycle
  bool complete = true;
  std::uint64_t next_after = 0;
  std::vector<Record> variables = {};
};
/// As a host tells them.
using VariableAnswer = VariablesOfOneMoment<plc_VariableRecord>;
/// As a client keeps them.
using ListedVariable = dds::Kept<plc_VariableRecord>;
using VariableListing = VariablesOfOneMoment<ListedVariable>;

/// full: the page is not all that was asked for, so the values of the rest would be of another moment.
[[nodiscard]] Result<void> is_whole(const VariableListing& page);

/// The bound of a page.
inline constexpr std::size_t kPageVariables = dds::bounds::VariablePage::variables;

/// A listing as it travels.
class VariablePageSample : public PageSample<plc_VariablePage> {
 public:
  /// At most kPageVariables. The answer outlives it.
  explicit VariablePageSample(VariableAnswer& answer);
};

[[nodiscard]] VariableListing listing_of(const plc_VariablePage& page);

}  // namespace plchost
