#include "api/client/wait_set.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "api/dds/error.hpp"

namespace plchost {

Result<WaitSet> WaitSet::create(dds_entity_t participant) {
  PLCHOST_TRY_ASSIGN(auto made,
                     dds::check_entity(dds_create_waitset(participant), "cannot create a wait set"));
  PLCHOST_TRY_ASSIGN(auto woken, dds::check_entity(dds_create_guardcondition(participant),
                                                   "cannot create a guard condition"));
  PLCHOST_TRY(
      dds::check_code(dds_waitset_attach(made.get(), woken.get(), woken.get()), "cannot add to a wait set"));
  return WaitSet(std::move(made), std::move(woken));
}

Result<void> WaitSet::add(dds_entity_t entity, std::uint32_t statuses) const {
  if (auto set = dds::check_code(dds_set_status_mask(entity, statuses), "cannot choose statuses"); !set)
    return set;
  return dds::check_code(dds_waitset_attach(set_.get(), entity, entity), "cannot add to a wait set");
}

void WaitSet::wait(TimePoint deadline) const noexcept {
  const Duration left = std::max(deadline - MonotonicClock::now(), Duration::zero());
  std::array<dds_attach_t, 32> triggered{};
  const dds_return_t count = dds_waitset_wait(set_.get(), triggered.data(), triggered.size(), left.count());
  bool woken = false;
  (void)dds_take_guardcondition(woken_.get(), &woken);
  // Told once. Else what nobody takes, because nobody waits for it any more, would end each wait at once.
  const auto told =
      std::clamp<std::size_t>(count > 0 ? static_cast<std::size_t>(count) : 0, 0, triggered.size());
  for (const dds_attach_t attached : std::span(triggered).first(told)) {
    const auto entity = static_cast<dds_entity_t>(attached);
    std::uint32_t statuses = 0;
    if (entity != woken_.get() && dds_get_status_mask(entity, &statuses) == DDS_RETCODE_OK)
      (void)dds_take_status(entity, &statuses, statuses);
  }
}

void WaitSet::wake() const noexcept {
  (void)dds_set_guardcondition(woken_.get(), true);
}

}  // namespace plchost
