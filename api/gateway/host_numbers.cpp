#include "api/gateway/host_numbers.hpp"

#include <algorithm>
#include <tuple>

#include "shm/base/names.hpp"

namespace plchost {

namespace {

bool comes_before(const HostClaim& one, const HostClaim& other) {
  return std::tie(one.since_ns, one.host) < std::tie(other.since_ns, other.host);
}

}  // namespace

void HostNumbers::claim(const HostClaim& other, TimePoint now) {
  if (other.host == own_.host || !check_name("host", other.host, kMaxHostName)) return;
  if (other.number == 0 || other.number > kMaxHostNumber) return;
  if (!epochs_[other.host].accept(other.epoch, now)) return;
  claims_[other.host] = other;
  if (ahead()) last_ahead_ = now;
}

void HostNumbers::forget(const std::string& host, TimePoint now) {
  if (ahead()) last_ahead_ = now;
  claims_.erase(host);
  epochs_.erase(host);
}

std::map<std::uint16_t, HostClaim> HostNumbers::others() const {
  std::map<std::uint16_t, HostClaim> others;
  for (const auto& [host, claim] : claims_) {
    if (claim.number == own_.number) continue;
    const auto [known, is_new] = others.try_emplace(claim.number, claim);
    if (!is_new && comes_before(claim, known->second)) known->second = claim;
  }
  return others;
}

std::optional<HostClaim> HostNumbers::ahead() const {
  for (const auto& [host, claim] : claims_) {
    if (claim.number == own_.number && comes_before(claim, own_)) return claim;
  }
  return std::nullopt;
}

std::vector<HostClaim> HostNumbers::behind() const {
  std::vector<HostClaim> behind;
  for (const auto& [host, claim] : claims_) {
    if (claim.number == own_.number && comes_before(own_, claim)) behind.push_back(claim);
  }
  return behind;
}

std::vector<HostRange> ranges_of(const std::vector<std::uint16_t>& sorted_numbers) {
  std::vector<HostRange> ranges;
  for (const std::uint16_t number : sorted_numbers) {
    if (!ranges.empty() && ranges.back().last + 1 == number) {
      ranges.back().last = number;
    } else {
      ranges.push_back({.first = number, .last = number});
    }
  }
  while (ranges.size() > kMaxHostRanges) {
    auto before = ranges.begin();
    for (auto at = ranges.begin(); std::next(at) != ranges.end(); ++at) {
      if (std::next(at)->first - at->last < std::next(before)->first - before->last) before = at;
    }
    before->last = std::next(before)->last;
    ranges.erase(std::next(before));
  }
  return ranges;
}

}  // namespace plchost
