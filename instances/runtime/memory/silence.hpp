#pragma once

#include "shm/plc_process_image.h"

namespace plchost {

/// Of an image that its writer fills by plc_image_write_watched(). If the last sign is too old, readers are
/// shown the image that it has left for that, until its next one. Any context.
inline void tell_silence(const plc_image& image) noexcept {
  const plc_image_u64 told = plc_image_control(&image);  // first: a sign that is given meanwhile changes it
  const plc_image_u64 state = told & PLC_IMAGE_STATE;
  if (state != PLC_IMAGE_STATE_RUNNING && state != PLC_IMAGE_STATE_UNTOLD) return;
  if (__atomic_load_n(&image.header->on_end, __ATOMIC_ACQUIRE) != 2) return;
  const plc_image_i64 sign_ns = plc_image_heartbeat_age_ns(&image);
  if (sign_ns != PLC_IMAGE_NEVER && sign_ns > PLC_IMAGE_PATIENCE_NS)
    (void)plc_image_tell_since(&image, told, PLC_IMAGE_STATE_SILENT, 1);
}

}  // namespace plchost
