# shm/block_driver/slot_ring.cpp: the reader may see a block before what is in it
s/position_word\(tail, slots\), std::memory_order_release/position_word(tail, slots), std::memory_order_relaxed/
