#include "instances/runtime/reference_memory.hpp"

#include "shm/base/log.hpp"

namespace plchost {

class ReferenceMemory::Source final : public ReferenceSource {
 public:
  explicit Source(ReferenceClockRecord record) noexcept : record_(std::move(record)) {}

  [[nodiscard]] bool replaced() const noexcept { return record_.replaced(); }

  [[nodiscard]] Reading read() noexcept override {
    plc_reference_reading reading{};
    switch (plc_reference_clock_read(&record_.record(), &reading)) {
      case PLC_REFERENCE_OK:
        return {
            .outcome = reading.valid != 0 ? Outcome::pair : Outcome::invalid,
            .pair = {.local = TimePoint(Duration(reading.local_ns)), .reference_ns = reading.reference_ns},
            .updates = reading.updates};
      case PLC_REFERENCE_CORRUPT:
        return {.outcome = Outcome::corrupt, .pair = {}, .updates = 0};
      default:
        return {};
    }
  }

 private:
  ReferenceClockRecord record_;
};

ReferenceMemory::ReferenceMemory() = default;
ReferenceMemory::~ReferenceMemory() = default;

Result<void> ReferenceMemory::follow(DistributedClock& clock, std::string pool, std::string name) {
  auto record = ReferenceClockRecord::open(pool, name);
  if (!record) return std::unexpected(std::move(record).error());
  auto source = std::make_unique<Source>(*std::move(record));
  if (!clock.use_source(source.get())) {
    return failure(ErrorCode::busy, "a task is caught at the reference clock that was in use before");
  }
  clock_ = &clock;
  pool_ = std::move(pool);
  name_ = std::move(name);
  source_ = std::move(source);  // nobody is at the one before any more
  return {};
}

void ReferenceMemory::refresh() {
  if (clock_ == nullptr || !source_->replaced()) return;
  const auto followed = follow(*clock_, pool_, name_);
  if (followed) {
    spdlog::info("reference clock '{}' was made anew and is followed again", name_);
  } else if (followed.error().code != ErrorCode::busy) {
    spdlog::error("{}", followed.error().describe());
    drop();
  }
}

ClockRuntime clock_runtime(const DistributedClock& clock) noexcept {
  ClockRuntime runtime;
  if (clock.leading() == nullptr) return runtime;
  const ClockStatus status = clock.status(*clock.leading());
  runtime.state = std::to_underlying(status.state);
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
