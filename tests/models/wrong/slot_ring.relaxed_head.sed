# shm/block_driver/slot_ring.cpp: the writer may fill slots that the reader still copies
# caught as: a data race: a write of bytes
s/compare_exchange_weak\(told, head, std::memory_order_release/compare_exchange_weak(told, head, std::memory_order_relaxed/
