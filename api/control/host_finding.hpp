#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "shm/base/result.hpp"

namespace plchost {

/// How much a finding costs. The numbers travel in the DDS API.
enum class FindingLevel : std::uint8_t {
  ok = 0,       ///< as it should be
  note = 1,     ///< could be better, or cannot be known
  warning = 2,  ///< cycles will sometimes start late
  problem = 3,  ///< no hard time on this host as it is
};
[[nodiscard]] std::string_view to_string(FindingLevel level) noexcept;

/// The result of one check of the host. The texts are for people, and bounded as in control.idl.
struct HostFinding {
  std::string id;  ///< of the check
  FindingLevel level = FindingLevel::ok;
  std::string subject;  ///< which cores, which file
  std::string found;
  std::string why;
  std::string advice;  ///< empty: nothing to change
};

inline constexpr std::size_t kMaxFindings = 64;
inline constexpr std::size_t kMaxFindingId = 31;
inline constexpr std::size_t kMaxFindingSubject = 127;
inline constexpr std::size_t kMaxFindingFound = 511;
inline constexpr std::size_t kMaxFindingWhy = 255;
inline constexpr std::size_t kMaxFindingAdvice = 511;

/// A part of the answer to ControlVerb::check_host. All of it may not fit into one packet: the argument of
/// the request says with which finding the part begins. Empty: look anew, and begin with the first.
struct FindingsPart {
  std::uint64_t check = 0;  ///< number of the look at the host; another than in the part before: begin anew
  std::size_t total = 0;    ///< findings of that check, at most kMaxFindings
  std::size_t first = 0;    ///< index of the first one in this part
  std::vector<HostFinding> findings;
};

/// The part of `all` from `first` on that fits into `max_bytes` as the text of a reply; at least one.
[[nodiscard]] std::string encode_part(std::uint64_t check, std::span<const HostFinding> all,
                                      std::size_t first, std::size_t max_bytes);
/// corrupt: not such a part; every number and text is within its bound.
[[nodiscard]] Result<FindingsPart> decode_part(std::string_view text);

/// "15" as in the argument of the request. invalid_argument: no number up to kMaxFindings.
[[nodiscard]] Result<std::size_t> parse_first_finding(std::string_view argument);

}  // namespace plchost
