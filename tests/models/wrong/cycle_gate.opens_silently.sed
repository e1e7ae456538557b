# schedulers/task/cycle_gate.hpp: who waits at the gate is not woken
s/clock\.wake\(closed_\);//
