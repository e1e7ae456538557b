# instances/runtime/debug/table_hold.hpp: the look may be later than the word that it has ended
# caught as: a data race
s/held_\.store\(nullptr, std::memory_order_release\)/held_.store(nullptr, std::memory_order_relaxed)/
