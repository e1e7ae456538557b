# shm/block_driver/slot_ring.cpp: a writer uses a freed slot that only the other writer knows to be copied
# caught as: the writer calls a sound link broken
s/seen = head_seen_\.load\(std::memory_order_acquire\)/seen = head_seen_.load(std::memory_order_relaxed)/
