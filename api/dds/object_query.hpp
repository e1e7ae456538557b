#pragma once

#include <optional>
#include <string>
#include <string_view>

#include <control.h>

#include "shm/base/result.hpp"
#include "shm/pool/object_info.hpp"

namespace plchost {

/// Which objects of a pool are asked for. An empty member asks for nothing.
struct ObjectQuery {
  std::string name = {};                          ///< this one alone; then all else is empty
  std::optional<ObjectType> type = std::nullopt;  ///< of this type only
  std::string match = {};                         ///< names like this pattern, see matches_pattern()
  std::string after = {};                         ///< names that are greater, in the order of bytes
};

/// invalid_argument: no type is called so; lists those that are.
[[nodiscard]] Result<ObjectType> parse_object_type(std::string_view text);

/// The query as it travels. invalid_argument: a name, or a pattern, that is too long or no UTF-8.
[[nodiscard]] Result<plc_ListPart> part_of(const ObjectQuery& query);
/// And back. invalid_argument: a value that cannot be, or a name beside others.
[[nodiscard]] Result<ObjectQuery> object_query_of(const plc_ListPart& part);

/// Whether a name is like the pattern: '*' stands for any characters, '?' for one, all others for themselves.
[[nodiscard]] bool matches_pattern(std::string_view pattern, std::string_view name) noexcept;

}  // namespace plchost
