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

bool HostPageCopy::refresh() {
  if (!page_) {
    auto opened = HostPageReader::open(pool_);
    if (!opened) return false;
    page_ = *std::move(opened);
  }
  const auto host = page_->host();
  bool all = host.has_value();
  bool known = all;
  if (host) {
    places_.resize(host->instance_count);
    for (std::size_t i = 0; i < places_.size(); ++i) {
      const auto status = page_->instance(static_cast<std::uint32_t>(i));
      if (status) places_[i] = *status;
      all &= status.has_value();
      known &= places_[i].has_value();
    }
  }
  // The number of instances is taken over once all of them are known.
  if (known) host_ = *host;
  if (page_->lost()) page_.reset();  // the manager makes it anew
  return all;
}

std::vector<const InstanceStatus*> HostPageCopy::instances() const {
  std::vector<const InstanceStatus*> found;
  if (!host_) return found;
  const std::size_t count = std::min<std::size_t>(host_->instance_count, places_.size());
  for (std::size_t i = 0; i < count; ++i) {
    if (places_[i] && !places_[i]->name.view().empty()) found.push_back(&*places_[i]);
  }
  return found;
}

}  // namespace plchost
