#include "api/server/status/host_grid.hpp"

#include <cstdlib>

#include "api/dds/text.hpp"

namespace plchost {

namespace {

// The states of control.idl that matter here.
constexpr std::uint32_t kFreeRunning = 1;
constexpr std::uint32_t kStates = 6;  // a stranger may have written another one

}  // namespace

std::int64_t to_hundreds(std::int64_t ns) noexcept {
  constexpr std::int64_t kHundred = 100;
  return (ns + (ns < 0 ? -kHundred / 2 : kHundred / 2)) / kHundred * kHundred;
}

void HostGrid::add(const ClockRuntime& clock) {
  if (clock.state < kFreeRunning || clock.state >= kStates) return;
  ++instances_;
  if (clock.in_sync != 0) ++in_sync_;
  const std::int64_t offset_ns = to_hundreds(clock.offset_ns);
  // One that runs freely has not measured anything yet.
  const bool measures = clock.state != kFreeRunning;
  const bool further = measured_ == 0 || std::abs(offset_ns) > std::abs(offset_ns_);
  if (reference_.empty() || (measures && further)) reference_ = clock.reference.view();
  if (measures && further) offset_ns_ = offset_ns;
  if (measures) ++measured_;
}

void HostGrid::put(plc_HostStatus& sample) const noexcept {
  dds::copy_text(sample.grid_reference, reference_);
  sample.grid_instances = instances_;
  sample.grid_in_sync = in_sync_;
  sample.grid_measured = measured_;
  sample.grid_offset_ns = offset_ns_;
}

}  // namespace plchost
