# instances/adapters/application/places.c: the value of before stays in the area, although a task has put a newer one meanwhile
# caught as: the area has not the value that was assigned last
s/old = exchange\((use->place, last, mixed\(last, value, bits\))\) \? 0 : bits;/(void)exchange(\1);/
