# instances/adapters/application/places.c: a value counts as exchanged before it is in the area, and one of before is taken for new
# caught as: an assigned value is undone
s/(    store\(place, area, value\);\n)( *is_old = [^\n]*\n)/\2\1/
