#include "shm/pool/instance_page.hpp"
