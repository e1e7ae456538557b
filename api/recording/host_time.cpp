#include "api/recording/host_time.hpp"

#include <algorithm>
#include <cmath>
#include <span>

namespace plchost {

namespace {

/// Sums and differences of such times do not overflow.
constexpr std::int64_t kMost = INT64_MAX / 4;
constexpr double kMostDrift = 1e-3;  // clocks of computers are 20 times as good

bool is_time(std::int64_t ns) noexcept {
  return ns >= 0 && ns <= kMost;
}

}  // namespace

std::int64_t HostTime::here(std::int64_t host_ns) const noexcept {
  const std::int64_t host = std::clamp<std::int64_t>(host_ns, 0, kMost);
  const double more = drift * static_cast<double>(host - at_ns);
  return std::max<std::int64_t>(host - offset_ns - std::llround(more), 0);
}

void HostTimeSamples::add(TimePoint asked, TimePoint answered, std::int64_t host_ns) {
  const std::int64_t from = asked.time_since_epoch().count();
  const std::int64_t to = answered.time_since_epoch().count();
  if (!is_time(from) || !is_time(to) || to < from || !is_time(host_ns)) return;
  const std::int64_t half = (to - from + 1) / 2;
  samples_.push_back({.host_ns = host_ns, .offset_ns = host_ns - (from + half), .uncertainty_ns = half});
}

std::optional<HostTime> HostTimeSamples::result() const {
  if (samples_.empty()) return std::nullopt;
  const std::span all(samples_);
  const auto fastest = [](std::span<const Sample> some) {
    return *std::ranges::min_element(some, {}, &Sample::uncertainty_ns);
  };
  const Sample best = fastest(all);
  HostTime time{.at_ns = best.host_ns, .offset_ns = best.offset_ns, .uncertainty_ns = best.uncertainty_ns};
  if (all.size() < 2) return time;
  const Sample early = fastest(all.first(all.size() / 2));
  const Sample late = fastest(all.subspan(all.size() / 2));
  const std::int64_t span = late.host_ns - early.host_ns;
  const std::int64_t change = late.offset_ns - early.offset_ns;
  if (span <= 0 || std::abs(change) <= early.uncertainty_ns + late.uncertainty_ns) return time;
  const double drift = static_cast<double>(change) / static_cast<double>(span);
  if (std::abs(drift) > kMostDrift) return time;
  return HostTime{.at_ns = early.host_ns,
                  .offset_ns = early.offset_ns,
                  .uncertainty_ns = std::max(early.uncertainty_ns, late.uncertainty_ns),
                  .drift = drift};
}

}  // namespace plchost
