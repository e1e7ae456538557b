# schedulers/task/cycle_gate.hpp: a seat is taken without being seen, and the gate looks open although it is closed
s/taken_\.store\(true, std::memory_order_seq_cst\)/taken_.store(true, std::memory_order_release)/
