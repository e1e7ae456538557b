# schedulers/tasks/activation_gate.hpp: a thread that sleeps at the gate is not woken
# caught as: asleep for ever: nobody wakes the sleeper
s/clock\.wake\(word_\);//
