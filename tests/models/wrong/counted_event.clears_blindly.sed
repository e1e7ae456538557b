# shm/base/counted_event.cpp: the waker takes off the mark, also if a waiter has announced itself since
# caught as: asleep for ever: nobody wakes the sleeper
s/state_\.compare_exchange_strong\(made, made & ~kWaiter, std::memory_order_acq_rel, std::memory_order_relaxed\)/state_.fetch_and(~kWaiter, std::memory_order_acq_rel)/
