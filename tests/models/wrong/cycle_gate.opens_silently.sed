# schedulers/faults/cycle_gate.hpp: a thread that waits at the gate is not woken
s/clock\.wake\(closed_\);//
