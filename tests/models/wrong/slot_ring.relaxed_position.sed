# shm/block_driver/slot_ring.cpp: the reader may see a block before what is in it
# caught as: a data race: a read of bytes
s/position_word\(tail, slots\), std::memory_order_release/position_word(tail, slots), std::memory_order_relaxed/
