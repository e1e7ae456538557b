#pragma once

#include "api/dds/entity.hpp"
#include "shm/base/result.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// Sleeps until one of several readers has data, one of several writers gets or loses a reader, or wake() is
/// called.
class WaitSet {
 public:
  WaitSet() noexcept = default;
  [[nodiscard]] static Result<WaitSet> create(dds_entity_t participant);
  /// `statuses`: DDS_DATA_AVAILABLE_STATUS and others of a reader, DDS_PUBLICATION_MATCHED_STATUS of a
  /// writer.
  [[nodiscard]] Result<void> add(dds_entity_t entity, std::uint32_t statuses) const;
  /// Returns at the deadline at the latest, and earlier without cause: look again. Look before the first wait
  /// and after each: a sample ends one wait, also if it is not taken.
  void wait(TimePoint deadline) const noexcept;
  /// Ends the wait that is under way, else the next one. Any thread.
  void wake() const noexcept;

 private:
  WaitSet(dds::Entity set, dds::Entity woken) noexcept : set_(std::move(set)), woken_(std::move(woken)) {}
  dds::Entity set_;
  dds::Entity woken_;  // a guard condition
};

}  // namespace plchost
