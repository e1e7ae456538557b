# schedulers/faults/cycle_gate.hpp: a seat with a part of a cycle looks empty
# caught as: a data race: a read of state
s/word_\.load\(std::memory_order_seq_cst\) != kOutside/word_.load(std::memory_order_seq_cst) == kWithin/
