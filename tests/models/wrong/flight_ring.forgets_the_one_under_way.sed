# shm/base/flight_ring.hpp: the entry that is under way counts for a whole one
# caught as: half of another entry
s/now - capacity \+ 1/now - capacity/
