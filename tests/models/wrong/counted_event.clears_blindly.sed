# shm/base/counted_event.cpp: who wakes takes off the mark, whoever has announced itself since
s/state_\.compare_exchange_strong\(made, made & ~kWaiter, std::memory_order_acq_rel, std::memory_order_relaxed\)/state_.fetch_and(~kWaiter, std::memory_order_acq_rel)/
