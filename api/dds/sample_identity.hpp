#pragma once

#include <algorithm>
#include <string>

#include <control.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

namespace plchost {

[[nodiscard]] inline bool same_identity(const plc_SampleIdentity& a, const plc_SampleIdentity& b) noexcept {
  return a.sequence_number == b.sequence_number && std::ranges::equal(a.writer_guid, b.writer_guid);
}

/// The same for a request and its repetitions, and for no other one.
[[nodiscard]] inline std::string request_id(const plc_SampleIdentity& identity) {
  return fmt::format("{:02x}.{}", fmt::join(identity.writer_guid, ""), identity.sequence_number);
}

}  // namespace plchost
