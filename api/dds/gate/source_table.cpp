#include "api/dds/gate/source_table.hpp"

#include <algorithm>
#include <utility>

namespace plchost::dds {

namespace {

std::size_t hash_of(std::span<const std::byte> bytes) noexcept {
  std::uint64_t hash = 14695981039346656037U;  // FNV-1a
  for (const std::byte byte : bytes) hash = (hash ^ std::to_integer<std::uint64_t>(byte)) * 1099511628211U;
  return static_cast<std::size_t>(hash ^ (hash >> 32U));
}

}  // namespace

bool SourceTable::is_its_own(std::span<const std::byte, kGuidPrefix> guid_prefix, std::uint16_t port,
                             TimePoint now) noexcept {
  const std::size_t set = hash_of(guid_prefix) % kSets;
  const auto ways = std::span(entries_).subspan(set * kWays, kWays);
  const auto is_free = [now](const Entry& entry) { return entry.port == 0 || now - entry.last > kForgotten; };
  const auto known = std::ranges::find_if(ways, [&](const Entry& entry) {
    return !is_free(entry) && std::ranges::equal(entry.guid_prefix, guid_prefix);
  });
  if (known != ways.end()) {
    if (known->port != port) return false;
    known->heard_again = true;
    known->last = now;
    return true;
  }
  Entry& oldest = *std::ranges::min_element(ways, {}, [&](const Entry& entry) {
    return is_free(entry) ? std::pair(false, TimePoint::min()) : std::pair(entry.heard_again, entry.last);
  });
  std::ranges::copy(guid_prefix, oldest.guid_prefix.begin());
  oldest.port = port;
  oldest.heard_again = false;
  oldest.last = now;
  return true;
}

}  // namespace plchost::dds
