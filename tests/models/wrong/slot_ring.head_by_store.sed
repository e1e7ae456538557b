# shm/block_driver/slot_ring.cpp: a thread that stood still sets the reader's head back
# caught as: the writer was not told the newest head
s/if \(head_\.compare_exchange_strong\(head, next, std::memory_order_seq_cst\)\) head = next;/head_.store(next), head = next;/
