# shm/plc_process_image.h: a word is told whatever was told meanwhile
# caught as: an image of a task that was stopped
s/return __atomic_compare_exchange_n\(&image->header->control, &told, now, 0, __ATOMIC_RELEASE,\s+__ATOMIC_RELAXED\);/__atomic_store_n(\&image->header->control, now, __ATOMIC_RELEASE); return 1;/
