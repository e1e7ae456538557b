# instances/adapters/application/places.c: a value of a task that is in the midst of its cycle goes out with one that interrupts it
# caught as: a value within a cycle goes out
s/another_is_in\(IN_CYCLE, task/another_is_in(OUTSIDE, task/
