# schedulers/faults/cycle_gate.hpp: the control thread may miss a seat that is taken, and the task the closed gate
# caught as: a data race: a read of state
s/return word_\.load\(std::memory_order_seq_cst\) != kOutside/return word_.load(std::memory_order_acquire) != kOutside/
