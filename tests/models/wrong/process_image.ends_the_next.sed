# shm/plc_process_image.h: the end is told although another process writes the image by now
# caught as: the end of the writer before in place of the next one
s/(__ATOMIC_RELAXED\)) != writer\) return 0;\s+return plc_image_tell_since\(image, told, PLC_IMAGE_STATE_ENDED, safe\);/\1 != writer) return 0;\n  plc_image_tell(image, PLC_IMAGE_STATE_ENDED, safe);\n  return 1;/
