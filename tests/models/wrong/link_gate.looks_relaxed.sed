# shm/block_driver/link_gate.hpp: the owner may miss a user that has found the old link
# caught as: a data race: a read of gone
s/users_\.load\(std::memory_order_seq_cst\) == 0/users_.load(std::memory_order_acquire) == 0/
