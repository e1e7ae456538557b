# schedulers/faults/cycle_gate.hpp: a seat with a part of a cycle looks empty
s/word_\.load\(std::memory_order_seq_cst\) != kOutside/word_.load(std::memory_order_seq_cst) == kWithin/
