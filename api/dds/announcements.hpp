#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include <dds/dds.h>

#include "api/dds/announced_addresses.h"
#include "api/dds/guid.hpp"

namespace plchost::dds {

/// Keeps the addresses to which a participant announces itself to those that were configured and those of
/// participants that are there. One thread, which calls DDS for this participant only.
class Announcements {
 public:
  Announcements() = default;
  /// Right after the participant was made: its addresses are the configured ones now.
  explicit Announcements(dds_entity_t participant);

  /// To be called periodically. `remote`: the participants that are there. Forgets the addresses that
  /// belonged to none of them at this call and at the last one, because the address of a new participant is
  /// known before the participant. Returns the number of forgotten addresses.
  ///
  /// A participant that comes again between two calls may be among them too late: Cyclone does not announce
  /// this process again to a participant that it knows. That participant would receive nothing. So a
  /// forgotten address comes back with it.
  std::size_t forget_gone(std::span<const Guid> remote);

 private:
  using Addresses = std::vector<plc_Address>;  // sorted

  [[nodiscard]] Addresses announced() const;
  [[nodiscard]] bool was_forgotten(const plc_Address& address) const noexcept;
  [[nodiscard]] Addresses used_by(std::span<const Guid> remote) const;

  dds_entity_t participant_ = 0;  ///< 0: nothing is forgotten
  Addresses configured_;
  Addresses in_doubt_;
  std::array<Addresses, 16> forgotten_;  ///< at the last calls, each in the place of the oldest
  std::size_t calls_ = 0;
};

}  // namespace plchost::dds
