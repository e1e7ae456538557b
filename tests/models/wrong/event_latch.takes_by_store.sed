# schedulers/tasks/event_latch.hpp: a run that becomes due while another one is taken is forgotten
# caught as: an edge is neither a run nor counted as lost
s/due_\.fetch_sub\(1, std::memory_order_acq_rel\)/due_.store(due_.load(std::memory_order_relaxed) - 1, std::memory_order_release)/
