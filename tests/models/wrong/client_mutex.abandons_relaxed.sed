# shm/threads/client_mutex.cpp: the writes of a thread before its end are not passed on
# caught as: a data race: a read of the guarded value
s/(kAbandoned \| \(word & kSomebodyWaits\), std::memory_order_)release/\1relaxed/
