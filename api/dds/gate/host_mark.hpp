#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace plchost::dds {

/// A host as it describes itself to other hosts, in the user data of its participant.
struct HostMark {
  std::string_view name;      ///< of the host
  bool sends_blocks = false;  ///< it has a number for other hosts ([blocks] host_number)
};

/// Its words in the announcement. Hosts before this one have none, and clients have others.
[[nodiscard]] std::string words_of(const HostMark& mark);
/// Nothing: they are not of a host, or of one that says more than this version knows.
[[nodiscard]] std::optional<HostMark> host_mark_of(std::string_view words) noexcept;

/// Whether two hosts have to know of each other: they want the same name, or both send blocks. Both come to
/// the same answer.
[[nodiscard]] bool concern_each_other(const HostMark& one, const HostMark& other) noexcept;

/// Takes the announcements of hosts that do not concern `own` out of a datagram that admit() has passed, in
/// place: to Cyclone such a host is not there. Without this each host of a plant would know all readers and
/// writers of all other hosts, and renew a lease with each of them. Returns the size that the datagram has;
/// 0: nothing is left to be said.
[[nodiscard]] std::size_t take_out_other_hosts(std::span<std::byte> datagram, const HostMark& own) noexcept;

}  // namespace plchost::dds
