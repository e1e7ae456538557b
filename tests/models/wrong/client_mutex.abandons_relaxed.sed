# shm/base/client_mutex.cpp: what a thread has written before its end is not passed on
# caught as: a data race: a read of the guarded value
s/(kAbandoned \| \(word & kSomebodyWaits\), std::memory_order_)release/\1relaxed/
