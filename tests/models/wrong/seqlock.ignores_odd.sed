# shm/base/seqlock.hpp: a reader takes what it finds in the midst of a write
# caught as: half of another value
s/if \(\(before & 1\) != 0\) continue;//
