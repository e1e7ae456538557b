# instances/adapters/application/places.c: a value of the firmware replaces the one that a task has assigned meanwhile
# caught as: an assigned value is undone
s/!set_value_if\(place->value, place->bytes, before,\s*mixed\(value_of\(place, &before\), now, bits\)\)/(set_value(place->value, place->bytes, now), 0)/
