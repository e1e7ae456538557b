# schedulers/faults/cycle_gate.hpp: code that waits at the gate in its middle does not look so
# caught as: a look takes half a cycle for a whole one
s/if \(gate != nullptr\) enter\(\*gate, clock\);\n      still_\.store\(false, std::memory_order_release\);/still_.store(false, std::memory_order_release);\n      if (gate != nullptr) enter(*gate, clock);/
