# shm/block_driver/link_gate.hpp: a link goes before the last look of a thread that was inside
# caught as: a data race: a write of gone
s/fetch_sub\(1, std::memory_order_release\)/fetch_sub(1, std::memory_order_relaxed)/
