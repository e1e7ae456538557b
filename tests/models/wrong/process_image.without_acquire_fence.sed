# shm/plc_process_image.h: the slot's sequence can be looked at again before the words are read
s/__atomic_thread_fence\(__ATOMIC_ACQUIRE\);//
