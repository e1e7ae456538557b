# schedulers/faults/cycle_gate.hpp: the gate is closed without being seen
# caught as: a data race: a read of state
s/closed_\.store\(1, std::memory_order_seq_cst\)/closed_.store(1, std::memory_order_release)/
