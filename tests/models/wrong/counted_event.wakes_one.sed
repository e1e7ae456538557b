# shm/base/counted_event.cpp: a post wakes only one of the waiters, each of which has a cursor of its own
s/futex_wake\(&state_\)/futex_wake(\&state_, 1)/
