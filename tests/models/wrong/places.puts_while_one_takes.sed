# instances/adapters/application/places.c: a value that another task is about to replace is taken for an assigned one
# caught as: a value of the firmware is undone
s/TAKES \| IN_CYCLE : TAKES/TAKES | IN_CYCLE : OUTSIDE/
