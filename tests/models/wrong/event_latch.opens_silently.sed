# schedulers/tasks/activation_gate.hpp: a thread that sleeps at the gate is not woken
s/clock\.wake\(word_\);//
