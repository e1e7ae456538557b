# schedulers/faults/cycle_gate.hpp: a task that waits at the gate looks as if it were in a cycle
# caught as: a task that waits at the gate has taken its seat
s/word_\.store\(kOutside, std::memory_order_release\);\n        clock/clock/
