# schedulers/tasks/activation_gate.hpp: a thread that sleeps at the gate is not woken
# caught as: asleep for ever: nobody wakes who sleeps
s/clock\.wake\(word_\);//
