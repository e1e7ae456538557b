# shm/plc_process_image.h: the tasks can be seen to run before their first image
# caught as: an image from before the first cycle
s/&told, running, 0, __ATOMIC_RELEASE,/\&told, running, 0, __ATOMIC_RELAXED,/
