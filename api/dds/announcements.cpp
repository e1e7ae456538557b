#include "api/dds/announcements.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <iterator>
#include <utility>

namespace plchost::dds {

namespace {

// They have no padding.
static_assert(sizeof(plc_Address) == 24);
bool is_before(const plc_Address& one, const plc_Address& other) noexcept {
  return std::memcmp(&one, &other, sizeof one) < 0;
}

std::vector<plc_Address> without(const std::vector<plc_Address>& all, const std::vector<plc_Address>& these) {
  std::vector<plc_Address> rest;
  std::ranges::set_difference(all, these, std::back_inserter(rest), is_before);
  return rest;
}

std::vector<plc_Address> common(const std::vector<plc_Address>& one, const std::vector<plc_Address>& other) {
  std::vector<plc_Address> both;
  std::ranges::set_intersection(one, other, std::back_inserter(both), is_before);
  return both;
}

}  // namespace

Announcements::Announcements(dds_entity_t participant)
    : participant_(plc_can_tell_addresses(participant) ? participant : 0), configured_(announced()) {}

std::vector<plc_Address> Announcements::announced() const {
  constexpr std::size_t kMore = 64;  // may come between the calls; the others are told the next time
  std::vector<plc_Address> addresses(plc_announced_addresses(participant_, nullptr, 0) + kMore);
  const std::size_t count = plc_announced_addresses(participant_, addresses.data(), addresses.size());
  addresses.resize(std::min(count, addresses.size()));
  std::ranges::sort(addresses, is_before);
  return addresses;
}

bool Announcements::was_forgotten(const plc_Address& address) const noexcept {
  return std::ranges::any_of(forgotten_, [&address](const Addresses& at_once) {
    return std::ranges::binary_search(at_once, address, is_before);
  });
}

// Those that were forgotten are announced to again.
Announcements::Addresses Announcements::used_by(std::span<const Guid> remote) const {
  Addresses used;
  for (const Guid& guid : remote) {
    dds_guid_t raw{};
    guid.copy_to(raw.v);
    std::array<plc_Address, 8> addresses{};
    const std::size_t count = plc_addresses_of(participant_, &raw, addresses.data(), addresses.size());
    for (const plc_Address& address : std::span(addresses).first(std::min(count, addresses.size()))) {
      if (was_forgotten(address)) (void)plc_announce_to(participant_, &raw, &address);
      used.push_back(address);
    }
  }
  std::ranges::sort(used, is_before);
  return used;
}

std::size_t Announcements::forget_gone(std::span<const Guid> remote) {
  auto doubtful = without(announced(), configured_);
  Addresses gone;
  if (!doubtful.empty() || !std::ranges::all_of(forgotten_, &Addresses::empty)) {
    doubtful = without(doubtful, used_by(remote));
    gone = common(doubtful, in_doubt_);
  }
  std::size_t forgotten = 0;
  for (const plc_Address& address : gone) {
    forgotten += plc_stop_announcing_to(participant_, &address) ? 1U : 0U;
  }
  in_doubt_ = without(doubtful, gone);
  forgotten_[calls_++ % forgotten_.size()] = std::move(gone);
  return forgotten;
}

}  // namespace plchost::dds
