#pragma once

#include <dds/dds.h>

#include "api/dds/entity.hpp"

namespace plchost::dds {

/// Unregisters the instance of `sample`. No memory of it is kept, which dds_unregister_instance() alone does
/// not achieve. The history of `writer` must keep what it has written (transient local), and `writer` must
/// have written the instance. Any thread; one at a time for one instance.
void unregister_instance(dds_entity_t writer, const void* sample) noexcept;

/// Deletes an entity. If it is a writer, no memory of its announcement is kept. Its instances are to be
/// unregistered before. Waits for threads of Cyclone.
void delete_entity(Entity entity) noexcept;

}  // namespace plchost::dds
