# schedulers/tasks/event_latch.hpp: the task is woken before its run is due, and sleeps again
# caught as: a run that is due does not begin
s/due_\.fetch_add\(kept, std::memory_order_acq_rel\);\n *gate\.open\(clock\);/gate.open(clock);\n    due_.fetch_add(kept, std::memory_order_acq_rel);/
