#include "shm/pool/memory_file.hpp"
