# schedulers/faults/cycle_gate.hpp: a seat is taken without being seen, and the gate looks open although it is closed
# caught as: a data race: a read of state
s/word_\.store\(kWithin, std::memory_order_seq_cst\)/word_.store(kWithin, std::memory_order_release)/
