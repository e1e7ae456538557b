# shm/plc_process_image.h: the tasks can be seen to run before their first image
# caught as: an image from before the first cycle
s/(return __atomic_compare_exchange_n\(&image->header->control, &told, now, 0, )__ATOMIC_RELEASE(,\s+__ATOMIC_RELAXED\);)/if (state == PLC_IMAGE_STATE_RUNNING) \1__ATOMIC_RELAXED\2\n  \1__ATOMIC_RELEASE\2/
