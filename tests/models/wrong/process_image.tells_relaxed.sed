# shm/plc_process_image.h: the safe image can be told before it is there
# caught as: no safe image, although it is told
s/&before, after, 0, __ATOMIC_RELEASE,/\&before, after, 0, __ATOMIC_RELAXED,/
