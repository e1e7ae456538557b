# shm/base/counted_event.hpp: the earlier writes of the poster are not passed on
# caught as: a data race: a read of memory
s/fetch_add\(kOnePost, std::memory_order_release\)/fetch_add(kOnePost, std::memory_order_relaxed)/
