# instances/adapters/application/places.c: the value of before stays in the area, although a task has put a newer one meanwhile
# caught as: the area has not the value that was assigned last
s/is_old = !exchange\(([^)]*)\)/(void)exchange(\1)/
