# shm/base/flight_ring.hpp: the count can be read again before the words are read
# caught as: half of another entry
s/std::atomic_thread_fence\(std::memory_order_acquire\);//
