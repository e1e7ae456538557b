# instances/adapters/application/places.c: a value that another task is about to replace is taken for an assigned one
# caught as: a value of the firmware is undone
s/\n *if \(bits != 0 && another_is_in\(TAKES[^\n]*bits = 0;//
