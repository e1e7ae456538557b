# shm/plc_process_image.h: the first image ends whatever was told meanwhile
# caught as: an image of a task that was stopped
s/\(void\)__atomic_compare_exchange_n\(&image->header->control, &told, running, 0, __ATOMIC_RELEASE,\s+__ATOMIC_RELAXED\);/__atomic_store_n(\&image->header->control, running, __ATOMIC_RELEASE);/
