#include "shm/pool/host_page.hpp"
