# shm/base/flight_ring.hpp: a reader that sees a new word need not see that the entry before it is counted
# caught as: half of another entry
s/std::atomic_thread_fence\(std::memory_order_release\);//
