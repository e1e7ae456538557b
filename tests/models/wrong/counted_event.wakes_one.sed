# shm/base/counted_event.cpp: a post wakes only one of the waiters, each of which has a cursor of its own
# caught as: asleep for ever: nobody wakes the sleeper
s/futex_wake\(&state_\)/futex_wake(\&state_, 1)/
