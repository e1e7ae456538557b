# shm/base/counted_event.cpp: a waiter that finds the mark changes nothing, so the waker cannot see that it came
# caught as: asleep for ever: nobody wakes the sleeper
s/next_turn\(expected\) \| kWaiter/expected | kWaiter/
