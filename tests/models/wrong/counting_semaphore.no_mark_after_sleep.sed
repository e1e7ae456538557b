# shm/base/counting_semaphore.cpp: a woken thread does not mark the word for those that still sleep
s/mark = kWaiter;//
