#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "api/cli/rows/status_rows.hpp"
#include "api/cli/rows/table.hpp"
#include "api/dds/object_page.hpp"

namespace plchost {

/// Fields that are null for a type that has none of them.
[[nodiscard]] dds::Computed<plc_ObjectRecord, Row> computed_of(const plc_ObjectRecord& object,
                                                               std::string_view host,
                                                               const ListedObject& listed);
/// One object of a host's pool, for programs: the same fields for all types. The field names are a promise.
[[nodiscard]] Row to_row(std::string_view host, const ListedObject& object);

/// For the table: a line of few cells, see object_columns().
[[nodiscard]] Row to_short_row(std::string_view host, const ListedObject& object);
/// `value` and `by` put several members of a record together, so control.idl has no columns for it.
[[nodiscard]] const std::vector<Column>& object_columns();

/// The changing part of an object, in words: "12 posts, registered, 1 task", "held by demo(4711), thread
/// 4713".
[[nodiscard]] std::string state_text(const ListedObject& object);
/// The processes with references on it: "plc-instance(4711), python3(88) and 5 more".
[[nodiscard]] std::string holders_text(const ListedObject& object, std::size_t most);

/// All that is known of it, for people.
[[nodiscard]] std::string format_object(std::string_view host, const ListedObject& object);

}  // namespace plchost
