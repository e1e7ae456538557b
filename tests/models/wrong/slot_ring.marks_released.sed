# shm/block_driver/slot_ring.cpp: of two threads that are done at once each may miss the other's mark, and the head stays
# caught as: a block is lost
s/kDone\), std::memory_order_seq_cst/kDone), std::memory_order_release/
