# shm/threads/client_mutex.cpp: a mutex is taken from an owner that lives
# caught as: a data race: a read of the guarded value
s/owner == kAbandoned \|\| !roll\.lives\(owner\)\) \{/owner == kAbandoned || roll.lives(owner)) {/
