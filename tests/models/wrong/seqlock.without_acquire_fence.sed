# shm/base/seqlock.hpp: the sequence can be looked at again before the words are read
# caught as: half of another value
s/std::atomic_thread_fence\(std::memory_order_acquire\);//
