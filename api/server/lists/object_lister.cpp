#include "api/server/lists/object_lister.hpp"

#include <algorithm>
#include <string_view>

#include <fmt/format.h>

#include "api/server/lists/account_names.hpp"
#include "shm/base/names.hpp"
#include "shm/process/thread_owner.hpp"

namespace plchost {

namespace {

constexpr int kLookShare = 4;  // a look is used for so many times as long as it took
constexpr Duration kForgotten = std::chrono::seconds(2);
// The names of a larger pool are not compared, to say which one may have been meant.
constexpr std::size_t kMostCompared = 4096;

bool is_wanted(const ObjectQuery& query, const ObjectInfo& object) {
  return (!query.type || object.type == *query.type) &&
         (query.match.empty() || matches_pattern(query.match, object.name));
}

// Any program may have written the word in shared memory: a thread of a process without a reference does not
// hold the mutex.
bool may_hold(const ObjectInfo& mutex, std::uint32_t pid) {
  return mutex.reference_count > mutex.references.size() ||
         std::ranges::find(mutex.references, pid, &ReferenceInfo::pid) != mutex.references.end();
}

ObjectUsers users_of(const ObjectInfo& object) {
  ObjectUsers users{.owner_name = user_name(object.owner), .group_name = group_name(object.group)};
  const ObjectTraits* const traits = traits_of(object.type);
  if (traits == nullptr || !traits->has_holder || object.value == 0) return users;
  if (object.holder != 0) {
    const auto holder = std::ranges::find(object.references, object.holder, &ReferenceInfo::start);
    if (holder == object.references.end()) return users;
    users.holder_pid = holder->pid;
    users.holder_program = holder->program;
    return users;
  }
  auto owner = owner_of_thread(static_cast<std::uint32_t>(object.value));
  if (!owner || !may_hold(object, owner->pid)) return users;
  users.holder_pid = owner->pid;
  users.holder_program = std::move(owner->program);
  return users;
}

}  // namespace

Result<void> ObjectLister::look() {
  const TimePoint begin = MonotonicClock::now();
  wanted_ = begin;
  if (begin < seen_until_) return {};
  PLCHOST_TRY_ASSIGN(seen_, pool_->list());
  std::ranges::sort(seen_, {}, &ObjectInfo::name);
  const TimePoint end = MonotonicClock::now();
  seen_until_ = end + kLookShare * (end - begin);
  return {};
}

void ObjectLister::forget_old(TimePoint now) {
  if (!seen_.empty() && now - wanted_ > kForgotten) {
    seen_ = {};
    seen_until_ = {};
  }
}

std::string ObjectLister::like(std::string_view name) {
  if (!look() || seen_.size() > kMostCompared) return "";
  std::vector<std::string_view> names;
  names.reserve(seen_.size());
  for (const ObjectInfo& object : seen_) names.emplace_back(object.name);
  const auto near = nearest_name(name, names);
  return near.empty() ? "" : fmt::format(" (did you mean '{}'?)", near);
}

Result<ObjectListing> ObjectLister::one(const std::string& name) {
  const auto found = pool_->look_at(name);
  if (found) {
    ObjectListing listing;
    listing.objects.push_back(listed_of(*found, users_of(*found)));
    return listing;
  }
  Error error = found.error();
  if (error.code == ErrorCode::not_found) error.message += like(name);
  return std::unexpected(std::move(error));
}

Result<ObjectListing> ObjectLister::page(const ObjectQuery& query, TimePoint until) {
  if (!query.name.empty()) return one(query.name);
  PLCHOST_TRY(look());
  constexpr std::size_t kClockEvery = 64;
  ObjectListing listing;
  std::size_t references = 0;
  auto at = query.after.empty() ? seen_.begin()
                                : std::ranges::upper_bound(seen_, query.after, {}, &ObjectInfo::name);
  for (std::size_t step = 1; at != seen_.end(); ++at, ++step) {
    const bool wanted = is_wanted(query, *at);
    const bool fits = listing.objects.empty() || (listing.objects.size() < kPageObjects &&
                                                  references + at->references.size() <= kPageReferences);
    if (wanted && !fits) break;
    listing.next_after = at->name;
    if (wanted) {
      references += at->references.size();
      listing.objects.push_back(listed_of(*at, users_of(*at)));
    }
    if (step % kClockEvery == 0 && MonotonicClock::now() >= until) {
      ++at;
      break;
    }
  }
  listing.complete = at == seen_.end();
  if (listing.complete) listing.next_after.clear();
  return listing;
}

}  // namespace plchost
