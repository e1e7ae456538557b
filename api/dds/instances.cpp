#include "api/dds/instances.hpp"

#include "api/dds/instance_pin.h"

namespace plchost::dds {

void unregister_instance(dds_entity_t writer, const void* sample) noexcept {
  const plc_InstancePin pin = plc_pin_instance(writer, sample);
  (void)dds_unregister_instance(writer, sample);
  plc_take_off_pin(pin);
}

void delete_entity(Entity entity) noexcept {
  const plc_InstancePin pin = plc_pin_announcement(entity.get());
  entity.reset();
  plc_take_off_pin(pin);
}

}  // namespace plchost::dds
