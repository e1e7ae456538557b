#pragma once

#include <algorithm>

#include <control.h>

namespace plchost {

[[nodiscard]] inline bool same_identity(const plc_SampleIdentity& a, const plc_SampleIdentity& b) noexcept {
  return a.sequence_number == b.sequence_number && std::ranges::equal(a.writer_guid, b.writer_guid);
}

}  // namespace plchost
