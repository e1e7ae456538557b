#include "api/server/posts/event_directory.hpp"

#include <fmt/format.h>

namespace plchost {

Result<PoolEvent> EventDirectory::find(std::string_view instance, std::string_view event) {
  auto found = find_any(instance, event);
  if (found && !found->registered()) {
    return failure(ErrorCode::not_found, fmt::format("external event '{}' is not registered", name_));
  }
  return found;
}

Result<PoolEvent> EventDirectory::find_any(std::string_view instance, std::string_view event) {
  name_.assign(instance).append("/").append(event);
  if (const auto kept = kept_.find(std::string_view(name_)); kept != kept_.end()) {
    if (kept->second.valid()) return kept->second;
    kept_.erase(kept);
  }
  PLCHOST_TRY_ASSIGN(const auto found, if_found(pool_->open_event(name_)));
  if (!found) return failure(ErrorCode::not_found, fmt::format("no external event '{}'", name_));
  if (kept_.size() >= kMaxKept) kept_.clear();
  kept_.emplace(name_, *found);
  return *found;
}

}  // namespace plchost
