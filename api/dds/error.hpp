#pragma once

#include <string>

#include <dds/dds.h>

#include "api/dds/entity.hpp"
#include "shm/base/result.hpp"

namespace plchost::dds {

/// For calls that return an entity: it, or what was attempted and DDS's own word for why not.
[[nodiscard]] Result<Entity> check_entity(dds_entity_t returned, const std::string& step);

/// For calls that return a code.
[[nodiscard]] Result<void> check_code(dds_return_t returned, const std::string& step);

}  // namespace plchost::dds
