# shm/plc_process_image.h: the safe image is written over where it is
# caught as: no safe image after the end
s/\(before & 0xffu\) == PLC_IMAGE_SLOTS \? PLC_IMAGE_SLOTS \+ 1u : PLC_IMAGE_SLOTS;/PLC_IMAGE_SLOTS;/
