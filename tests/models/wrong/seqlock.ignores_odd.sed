# shm/base/seqlock.hpp: a reader takes what it finds in the midst of a write
s/if \(\(before & 1\) != 0\) continue;//
