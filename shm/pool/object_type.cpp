#include "shm/pool/object_type.hpp"

#include <fmt/format.h>

#include "shm/base/names.hpp"

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

bool is_object_name(std::string_view name) noexcept {
  return !name.empty() && name.size() <= kMaxObjectName && is_printable_utf8(name);
}

Result<void> check_object_name(std::string_view name) {
  if (is_object_name(name)) return {};
  std::string told(shown(name));
  for (char& c : told) {
    if (c < ' ' || c > '~') c = '?';
  }
  return failure(ErrorCode::invalid_argument,
                 fmt::format("object name '{}' ({} bytes) is not valid: allowed are 1 to {} bytes of UTF-8 "
                             "without control characters",
                             told, name.size(), kMaxObjectName));
}

}  // namespace plchost
