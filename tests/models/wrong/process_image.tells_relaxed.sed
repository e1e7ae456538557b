# shm/plc_process_image.h: the safe image can be told before it is there
# caught as: no safe image, although it is told
s/(return __atomic_compare_exchange_n\(&image->header->control, &told, now, 0, )__ATOMIC_RELEASE(,\s+__ATOMIC_RELAXED\);)/if (state == PLC_IMAGE_STATE_STOPPED) \1__ATOMIC_RELAXED\2\n  \1__ATOMIC_RELEASE\2/
