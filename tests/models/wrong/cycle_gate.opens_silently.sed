# schedulers/faults/cycle_gate.hpp: a thread that waits at the gate is not woken
# caught as: asleep for ever: nobody wakes the sleeper
s/clock\.wake\(closed_\);//
