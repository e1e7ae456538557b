# instances/adapters/application/places.c: a bit is written with the whole byte, and one that another task sets meanwhile is lost
# caught as: a bit is lost
s/__atomic_fetch_or\(byte, \(unsigned char\)\(1u << place->bit\), __ATOMIC_ACQ_REL\)/set_value(byte, 1, value_at(byte, 1) | (1u << place->bit))/
