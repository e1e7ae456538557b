# shm/base/counting_semaphore.cpp: units that came without a mark wake nobody
# caught as: asleep for ever: nobody wakes the sleeper
s/if \(mark != 0 && word - kOne >= kOne\) futex_wake\(&word_, 1\);//
