#include "shm/pages/host_page_copy.hpp"

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <thread>

#include <fmt/format.h>

namespace plchost {

Result<void> HostPageCopy::wait(TimePoint deadline) {
  constexpr Duration kAgain = std::chrono::milliseconds(1);
  for (;;) {
    (void)refresh();
    if (host_) return {};
    if (MonotonicClock::now() >= deadline) break;
    std::this_thread::sleep_for(kAgain);
  }
  return failure(
      ErrorCode::unavailable,
      fmt::format("page '{}' cannot be read: the manager has not written all of it", host_page_name(pool_)));
}

// A part that was not written since is not copied again: this is done for each post to an event that is not
// there. False: it is being written.
template <class Status, class Read>
bool HostPageCopy::update(Part<Status>& part, std::uint64_t sequence, Read read) {
  const bool is_whole = (sequence & 1) == 0;
  if (is_whole && part.status && sequence == part.sequence) return true;
  const auto status = read();
  if (!status) return false;
  part.status = *status;
  part.sequence = sequence;
  return true;
}

bool HostPageCopy::refresh() {
  if (!page_) {
    auto opened = HostPageReader::open(pool_);
    if (!opened) return false;
    page_ = *std::move(opened);
    newest_host_ = {};
    for (auto& place : places_) place.sequence = 1;  // of another page
  }
  bool all = update(newest_host_, page_->host_sequence(), [this] { return page_->host(); });
  if (all) {
    bool known = true;
    places_.resize(newest_host_.status->instance_count);
    for (std::uint32_t i = 0; i < places_.size(); ++i) {
      all &= update(places_[i], page_->instance_sequence(i), [this, i] { return page_->instance(i); });
      known &= places_[i].status.has_value();
    }
    // The number of instances is taken over once all of them are known.
    if (known) host_ = newest_host_.status;
  }
  if (page_->lost()) page_.reset();  // the manager makes it anew
  return all;
}

std::vector<const InstanceStatus*> HostPageCopy::instances() const {
  std::vector<const InstanceStatus*> found;
  if (!host_) return found;
  const std::size_t count = std::min<std::size_t>(host_->instance_count, places_.size());
  for (std::size_t i = 0; i < count; ++i) {
    const auto& status = places_[i].status;
    if (status && !status->name.view().empty()) found.push_back(&*status);
  }
  return found;
}

}  // namespace plchost
