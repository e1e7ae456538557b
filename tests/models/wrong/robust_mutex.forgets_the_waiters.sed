# shm/threads/robust_mutex.cpp: an unlock does not ask the kernel to hand the mutex on
# caught as: asleep for ever: nobody wakes the sleeper
s/word = self;\n/word_.store(0, std::memory_order_release);\n  return true;\n/
