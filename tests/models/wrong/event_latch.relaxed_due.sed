# schedulers/tasks/event_latch.hpp: a run can be seen before when its edge was
# caught as: a data race: a read of written
s/due_\.fetch_add\(kept, std::memory_order_acq_rel\)/due_.fetch_add(kept, std::memory_order_relaxed)/
