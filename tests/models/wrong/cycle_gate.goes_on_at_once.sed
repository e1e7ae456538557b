# schedulers/faults/cycle_gate.hpp: code that stood still goes on while the gate is closed
# caught as: a data race
s/if \(gate != nullptr\) enter\(\*gate, clock\);\n      still_/still_/
