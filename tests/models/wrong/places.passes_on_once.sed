# instances/adapters/application/places.c: a bit that another task assigns meanwhile stays in one of two places
# caught as: places that share bits have two values
s/  \} while \(\(\(value_of\(place, place->value\) \^ value\) & bits\) != 0\);/  } while (0);/
