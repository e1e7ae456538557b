# shm/base/counted_event.hpp: what the poster wrote before is not passed on
s/fetch_add\(kOnePost, std::memory_order_release\)/fetch_add(kOnePost, std::memory_order_relaxed)/
