# shm/base/counting_semaphore.cpp: who was woken does not mark the word for those that still sleep
s/mark = kWaiter;//
