# shm/block_driver/slot_ring.cpp: a thread that stood still tells the writer a head that it had been told before
# caught as: the writer was not told the newest head
s/std::uint64_t told = memory_\.head->load\(std::memory_order_relaxed\);\n  while \(told < head[^{]*\{\n  \}/do {\n    head = head_.load(std::memory_order_acquire);\n    memory_.head->store(head, std::memory_order_release);\n  } while (head_.load(std::memory_order_seq_cst) != head);/
