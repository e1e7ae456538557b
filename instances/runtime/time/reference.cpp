#include "instances/runtime/time/reference.hpp"

#include <array>
#include <string_view>
#include <utility>

#include "instances/runtime/settings/reference_name.hpp"
#include "instances/runtime/time/host_reference.hpp"
#include "instances/runtime/time/reference_memory.hpp"
#include "shm/log/log.hpp"

namespace plchost {

namespace {

// In the order of ClockSilence.
constexpr std::array<std::string_view, 7> kSilences{
    "",
    "the reference clock is silent: nobody has written its time for ReferenceTimeoutMs",
    "the reference clock stands still: it shows the same time again and again",
    "the times of the reference clock lie on no line that a clock has, and are left out",
    "the local stamps of the reference clock are not of now, and are left out",
    "the reference clock does not hold, as its writer says",
    "the record of the reference clock was overwritten by another program"};

}  // namespace

void Reference::tell(std::string problem) {
  if (!problem.empty() && problem != problem_) spdlog::error("{}; the clock runs freely", problem);
  problem_ = std::move(problem);
}

std::unique_ptr<Reference> follow_reference(DistributedClock& clock, const DistributedClockSettings& settings,
                                            const std::string& pool) {
  const auto name = parse_reference(settings.reference);
  if (!name) return nullptr;
  if (name->kind == ReferenceName::Kind::record) {
    return std::make_unique<ReferenceMemory>(clock, pool, name->text);
  }
  return std::make_unique<HostReference>(clock, linux_clock_system(), *name,
                                         HostReference::period(settings.reference_timeout));
}

ClockRuntime clock_runtime(const DistributedClock& clock) noexcept {
  ClockRuntime runtime;
  if (clock.leading() == nullptr) return runtime;
  const ClockStatus status = clock.status(*clock.leading());
  runtime.state = std::to_underlying(status.state);
  runtime.problem.assign(kSilences.at(std::to_underlying(status.silence)));
  runtime.in_sync = status.in_sync ? 1 : 0;
  runtime.offset_ns = status.offset_ns;
  runtime.drift_ppb = status.drift_ppb;
  runtime.correction_ns = status.correction_ns;
  runtime.correction_max_ns = status.correction_max_ns;
  runtime.corrections_at_bound = status.corrections_at_bound;
  runtime.pairs = status.pairs;
  runtime.rejected = status.rejected;
  runtime.invalid = status.invalid;
  runtime.steps = status.steps;
  return runtime;
}

}  // namespace plchost
