# schedulers/tasks/event_latch.hpp: the writes before an edge are not passed on
# caught as: a data race: a read of written
s/raised_\.fetch_add\(1, std::memory_order_release\)/raised_.fetch_add(1, std::memory_order_relaxed)/
