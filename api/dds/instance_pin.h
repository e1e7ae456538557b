#pragma once

#include <dds/dds.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/// An instance of a writer that cannot leave Cyclone's table of instances. Empty, if there is none.
///
/// Cyclone DDS 0.10.2 to 0.10.5 does not give back the reference that the history of a writer has to each of
/// its instances. It keeps it when the instance is unregistered, and also when the writer is deleted. The key
/// stays in memory as long as the process runs, some 300 bytes. The announcement of each writer is such an
/// instance, too, of 550 bytes. A pin is taken before the instance leaves the history and is taken off
/// afterwards. If the number of references is the same as before, then the history's was forgotten, and is
/// given back. With a library that gives it back by itself a pin changes nothing.
typedef struct plc_InstancePin {
  struct ddsi_domaingv* domain;
  struct ddsi_tkmap_instance* instance;
  uint32_t references;
} plc_InstancePin;

/// Pins an instance that `writer`, whose history keeps what it has written (transient local), has written.
/// `sample`: with its key.
plc_InstancePin plc_pin_instance(dds_entity_t writer, const void* sample);

/// Pins the announcement of a writer. Empty, if `entity` is no writer.
plc_InstancePin plc_pin_announcement(dds_entity_t entity);

/// After the instance was unregistered or the writer deleted. In the thread that has pinned.
void plc_take_off_pin(plc_InstancePin pin);

#ifdef __cplusplus
}
#endif
