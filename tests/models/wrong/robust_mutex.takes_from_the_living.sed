# shm/threads/robust_mutex.cpp: a mutex whose owner has not told its record is taken from it
# caught as: a data race: a read of the guarded value
s/if \(told && \(later \|\| another\)\) return OwnerState::gone;/if (!told) return OwnerState::gone;/
