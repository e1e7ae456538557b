# shm/base/counting_semaphore.cpp: a thread that wakes nobody takes the mark off if the word is as it was, which can happen again
# caught as: asleep for ever: nobody wakes the sleeper
s/\(before & ~kWaiter\) \+ kOne/before + kOne/
s/if \(\(before & kWaiter\) != 0\) futex_wake\(&word_, 1\);/if ((before \& kWaiter) == 0) return true;\n  if (futex_wake(\&word_, 1) == 0) {\n    std::uint32_t made = before + kOne;\n    word_.compare_exchange_strong(made, made \& ~kWaiter, std::memory_order_release, std::memory_order_relaxed);\n  }/
s/if \(mark != 0 && word - kOne >= kOne\) futex_wake\(&word_, 1\);//
s/mark = kWaiter;//
