# shm/base/flight_ring.hpp: an entry is counted before it is written
# caught as: an entry that nobody has written
s/Word\* const place = words_ \+ \(count_ & mask_\) \* kWordsOfEntry;/Word* const place = words_ + (count_ \& mask_) * kWordsOfEntry; written_->store(count_ + 1, std::memory_order_release);/
