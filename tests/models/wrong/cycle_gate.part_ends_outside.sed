# schedulers/faults/cycle_gate.hpp: the end of a part empties the seat, although the cycle goes on
s/word_\.store\(before_, std::memory_order_release\)/word_.store(kOutside, std::memory_order_release)/
