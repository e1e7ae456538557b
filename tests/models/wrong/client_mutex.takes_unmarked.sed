# shm/threads/client_mutex.cpp: one that has waited takes the mutex without the mark that others may wait
# caught as: asleep for ever: nobody wakes the sleeper
s/word, self\.client \| kSomebodyWaits, std::memory_order_acquire/word, self.client, std::memory_order_acquire/
