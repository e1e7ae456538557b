#pragma once

#include <array>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>

namespace plchost::testing {

/// The clock that applications/simulated_phc.cpp serves as a device, as its file describes it:
/// "DRIFT_PPB OFFSET_NS WAY".
struct SimulatedPhc {
  std::int64_t drift_ppb = 0;  ///< against CLOCK_MONOTONIC
  std::int64_t offset_ns = 0;  ///< how far it was set forward
  std::string way;             ///< the best way that it can be read: precise, extended, or none

  [[nodiscard]] static SimulatedPhc read(const char* path) {
    SimulatedPhc phc;
    const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path, "re"), &std::fclose);
    std::array<char, 16> way{};
    long long drift = 0;
    long long offset = 0;
    if (file != nullptr && std::fscanf(file.get(), "%lld %lld %15s", &drift, &offset, way.data()) == 3) {
      phc = {.drift_ppb = drift, .offset_ns = offset, .way = way.data()};
    }
    return phc;
  }
  /// Its time at a time of CLOCK_MONOTONIC.
  [[nodiscard]] std::int64_t at(std::int64_t local_ns) const noexcept {
    constexpr std::int64_t kSecond = 1'000'000'000;
    constexpr std::int64_t kEpoch = 1'700'000'000 * kSecond;
    return kEpoch + local_ns + local_ns / kSecond * drift_ppb + local_ns % kSecond * drift_ppb / kSecond +
           offset_ns;
  }
  /// How far that time is behind the nearest point of the grid; negative: before it.
  [[nodiscard]] std::int64_t phase_ns(std::int64_t local_ns, std::int64_t interval_ns) const noexcept {
    const std::int64_t phase = at(local_ns) % interval_ns;
    return phase > interval_ns / 2 ? phase - interval_ns : phase;
  }
};

}  // namespace plchost::testing
