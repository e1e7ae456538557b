#include "shm/pool/object_type.hpp"

namespace plchost {

std::string_view to_string(ObjectType type) noexcept {
  switch (type) {
    case ObjectType::memory:
      return "memory";
    case ObjectType::semaphore:
      return "semaphore";
    case ObjectType::event:
      return "event";
    case ObjectType::mutex:
      return "mutex";
  }
  return "unknown";
}

}  // namespace plchost
