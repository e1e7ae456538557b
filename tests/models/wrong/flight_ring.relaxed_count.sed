# shm/base/flight_ring.hpp: a reader that sees the count need not see the entry
# caught as: an entry that nobody has written
s/written_->store\(\+\+count_, std::memory_order_release\)/written_->store(++count_, std::memory_order_relaxed)/
