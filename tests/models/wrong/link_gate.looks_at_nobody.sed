# shm/block_driver/link_gate.hpp: old links go even if a thread is inside
# caught as: a data race: a write of gone
s/ && users_\.load\(std::memory_order_seq_cst\) == 0//
