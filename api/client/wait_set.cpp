#include "api/client/wait_set.hpp"

#include <algorithm>

#include "api/dds/error.hpp"

namespace plchost {

Result<WaitSet> WaitSet::create(dds_entity_t participant) {
  auto made = dds::check_entity(dds_create_waitset(participant), "make a wait set");
  if (!made) return std::unexpected(made.error());
  auto woken = dds::check_entity(dds_create_guardcondition(participant), "make a guard condition");
  if (!woken) return std::unexpected(woken.error());
  if (auto added =
          dds::check_code(dds_waitset_attach(made->get(), woken->get(), woken->get()), "add to a wait set");
      !added) {
    return std::unexpected(added.error());
  }
  return WaitSet(std::move(*made), std::move(*woken));
}

Result<void> WaitSet::add(dds_entity_t entity, std::uint32_t statuses) {
  if (auto set = dds::check_code(dds_set_status_mask(entity, statuses), "choose statuses"); !set) return set;
  return dds::check_code(dds_waitset_attach(set_.get(), entity, entity), "add to a wait set");
}

void WaitSet::wait(TimePoint deadline) const noexcept {
  const Duration left = std::max(deadline - MonotonicClock::now(), Duration::zero());
  dds_attach_t triggered = 0;
  (void)dds_waitset_wait(set_.get(), &triggered, 1, left.count());
  bool woken = false;
  (void)dds_take_guardcondition(woken_.get(), &woken);
}

void WaitSet::wake() const noexcept {
  (void)dds_set_guardcondition(woken_.get(), true);
}

}  // namespace plchost
