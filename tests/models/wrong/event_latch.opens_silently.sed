# schedulers/activation/activation_gate.hpp: who sleeps at the gate is not woken
s/clock\.wake\(word_\);//
