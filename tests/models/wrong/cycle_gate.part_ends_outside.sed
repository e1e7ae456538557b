# schedulers/faults/cycle_gate.hpp: the end of a part empties the seat, although the cycle goes on
# caught as: a data race: a read of state
s/word_\.store\(before_, std::memory_order_release\)/word_.store(kOutside, std::memory_order_release)/
