# instances/adapters/application/places.c: a value on its way into the area undoes the one that was assigned since
# caught as: an assigned value is undone
s/ && !another_is_in\(PUTS, task, use->place\)//
