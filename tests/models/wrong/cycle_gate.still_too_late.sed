# schedulers/faults/cycle_gate.hpp: the seat is empty before it is said that the code stands still
# caught as: a look takes half a cycle for a whole one
s/still_\.store\(true, std::memory_order_relaxed\);\n      word_\.store\(kOutside, std::memory_order_release\);/word_.store(kOutside, std::memory_order_release);\n      still_.store(true, std::memory_order_relaxed);/
