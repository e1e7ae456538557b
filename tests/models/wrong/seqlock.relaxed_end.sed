# shm/base/seqlock.hpp: the even sequence can be seen before the words
# caught as: half of another value
s/sequence_\.store\(sequence \+ 2, std::memory_order_release\)/sequence_.store(sequence + 2, std::memory_order_relaxed)/
