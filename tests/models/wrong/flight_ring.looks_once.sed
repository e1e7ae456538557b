# shm/base/flight_ring.hpp: no look at how far the writer has come meanwhile
# caught as: half of another entry
s/const std::uint64_t now = written.load\(std::memory_order_relaxed\);/const std::uint64_t now = end;/
