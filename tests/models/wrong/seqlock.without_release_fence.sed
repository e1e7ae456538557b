# shm/base/seqlock.hpp: a new word can be seen before the odd sequence
# caught as: half of another value
s/std::atomic_thread_fence\(std::memory_order_release\);//
