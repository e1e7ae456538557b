# instances/adapters/application/places.c: a task takes between the two looks of one that puts, which puts the old value
# caught as: a value of the firmware is undone
s/\n *if \(exchanged\(use->place\) != last[^\n]*continue;//
