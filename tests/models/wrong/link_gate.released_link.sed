# shm/block_driver/link_gate.hpp: the new link is put there without being seen by a thread that enters
# caught as: a data race: a read of gone
s/link_\.store\(next\.get\(\), std::memory_order_seq_cst\)/link_.store(next.get(), std::memory_order_release)/
