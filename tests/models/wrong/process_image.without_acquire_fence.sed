# shm/plc_process_image.h: the slot's sequence can be looked at again before the words are read
# caught as: half of another image
s/__atomic_thread_fence\(__ATOMIC_ACQUIRE\);//
