#pragma once

#include "shm/pool/object_info.hpp"
#include "shm/pool/pool_view.hpp"

namespace plchost {

/// The description of an object. Needs the pool's mutex, or that nothing was changed meanwhile; keeps to the
/// segment in any case.
[[nodiscard]] ObjectInfo describe_object(const PoolView& view, const ObjectEntry& entry);

}  // namespace plchost
