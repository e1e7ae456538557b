#pragma once

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

  /// From time to time. `remote`: the participants that are there. Forgets the addresses that belonged to
  /// none of them at the last call either, since one that is just coming has its address first. Returns how
  /// many it has forgotten.
  std::size_t forget_gone(std::span<const Guid> remote);

 private:
  [[nodiscard]] std::vector<plc_Address> announced() const;

  dds_entity_t participant_ = 0;  ///< 0: nothing is forgotten
  std::vector<plc_Address> configured_;
  std::vector<plc_Address> in_doubt_;
};

}  // namespace plchost::dds
