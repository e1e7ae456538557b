#include "api/server/clients/access_guard.hpp"

#include <fmt/format.h>

namespace plchost {

std::optional<security::Subject> AccessGuard::identity_of(const dds::Guid& entity) const {
  const std::lock_guard lock(mutex_);
  return known_ ? known_->find(entity.bytes) : std::nullopt;
}

Result<void> AccessGuard::check(const dds::Guid& entity, security::Role needed) const {
  {
    const std::lock_guard lock(mutex_);
    if (!known_) return {};
  }
  const auto identity = identity_of(entity);
  if (!identity) {
    return failure(ErrorCode::refused, "this host's folder does not know your identity: bring it up to date");
  }
  if (security::includes(identity->role, needed)) return {};
  return failure(ErrorCode::refused, fmt::format("'{}' is {}; this takes the role {}", identity->name,
                                                 to_string(identity->role), to_string(needed)));
}

void AccessGuard::replace(security::KnownIdentities known) {
  const std::lock_guard lock(mutex_);
  known_ = std::move(known);
}

}  // namespace plchost
