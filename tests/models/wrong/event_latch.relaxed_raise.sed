# schedulers/activation/event_latch.hpp: what was written before an edge is not passed on
s/raised_\.fetch_add\(1, std::memory_order_release\)/raised_.fetch_add(1, std::memory_order_relaxed)/
