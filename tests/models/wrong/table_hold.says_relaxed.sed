# instances/runtime/debug/table_hold.hpp: the word may be seen later than the look
# caught as: a data race
s/held_\.store\(table, std::memory_order_seq_cst\)/held_.store(table, std::memory_order_relaxed)/
