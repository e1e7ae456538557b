# instances/runtime/memory/silence.hpp: no silence is told of a first call that was cut off
# caught as: an image without an end
s/if \(state != PLC_IMAGE_STATE_RUNNING && state != PLC_IMAGE_STATE_UNTOLD\) return;/if (state != PLC_IMAGE_STATE_RUNNING) return;/
