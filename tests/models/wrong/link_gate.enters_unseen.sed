# shm/block_driver/link_gate.hpp: the owner sees no user, and the user still finds the old link
# caught as: a data race: a read of gone
s/users_\.fetch_add\(1, std::memory_order_seq_cst\)/users_.fetch_add(1, std::memory_order_acquire)/
