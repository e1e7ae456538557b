# shm/plc_process_image.h: a new word can be seen before the slot says that it is being written
# caught as: half of another image
s/__atomic_thread_fence\(__ATOMIC_RELEASE\);//
