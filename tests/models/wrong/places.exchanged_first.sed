# instances/adapters/application/places.c: a value counts as exchanged before it is in the area, and one of before is taken for new
# caught as: an assigned value is undone
s/(    store_bits\(place, area, value, bits\);\n)( *old = exchange[^\n]*\n)/\2\1/
