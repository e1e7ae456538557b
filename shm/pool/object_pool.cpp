#include "shm/pool/object_pool.hpp"
