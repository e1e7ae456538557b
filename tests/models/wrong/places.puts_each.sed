# instances/adapters/application/places.c: a bit is put again with each place that has it, after the firmware has reset it
# caught as: a value of the firmware is undone
s/\n *count_as_put\(task, use, value, bits\);//
