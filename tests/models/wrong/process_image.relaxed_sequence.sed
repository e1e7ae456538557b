# shm/plc_process_image.h: the slot can look complete before its words are
# caught as: half of another image
s/__atomic_store_n\(&slot->sequence, sequence, __ATOMIC_RELEASE\);/__atomic_store_n(\&slot->sequence, sequence, __ATOMIC_RELAXED);/
s/__atomic_store_n\(&image->header->latest, sequence << 8 \| number, __ATOMIC_RELEASE\);/__atomic_store_n(\&image->header->latest, sequence << 8 | number, __ATOMIC_RELAXED);/
