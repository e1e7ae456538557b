# shm/base/counting_semaphore.cpp: a woken thread does not mark the word for those that still sleep
# caught as: asleep for ever: nobody wakes the sleeper
s/mark = kWaiter;//
