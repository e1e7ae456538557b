# shm/plc_process_image.h: the writer fills the slot that is the latest
# caught as: an older image than before
s/\(latest & 0xffu\) \+ 1u\) % PLC_IMAGE_SLOTS/(latest \& 0xffu) + 0u) % PLC_IMAGE_SLOTS/
