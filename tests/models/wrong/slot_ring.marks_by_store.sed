# shm/block_driver/slot_ring.cpp: two threads take the same block
# caught as: a block was taken twice
s/if \(!marks_\[found\.at & \(memory_\.slots - 1\)\]\.compare_exchange_strong\(\n *before, mark_word\(found\.at, found\.step, kTaken\), std::memory_order_acq_rel,\n *std::memory_order_relaxed\)\)/if ((marks_[found.at \& (memory_.slots - 1)].store(mark_word(found.at, found.step, kTaken)), before != found.mark))/
