#include "instances/runtime/time/reference_memory.hpp"

#include <optional>

#include "shm/log/log.hpp"

namespace plchost {

class ReferenceMemory::Source final : public ReferenceSource {
 public:
  explicit Source(std::optional<ReferenceClockRecord> record) noexcept : record_(std::move(record)) {}

  [[nodiscard]] bool has_record() const noexcept { return record_.has_value(); }
  [[nodiscard]] bool is_good() const noexcept { return record_ && !record_->gone(); }

  [[nodiscard]] Reading read() noexcept override {
    if (!record_) return {};
    plc_reference_reading reading{};
    switch (plc_reference_clock_read(&record_->record(), &reading)) {
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
  std::optional<ReferenceClockRecord> record_;
};

ReferenceMemory::ReferenceMemory() = default;
ReferenceMemory::~ReferenceMemory() = default;

void ReferenceMemory::follow(DistributedClock& clock, std::string pool, std::string name) {
  clock_ = &clock;
  pool_ = std::move(pool);
  name_ = std::move(name);
  attach();
}

void ReferenceMemory::refresh() {
  if (clock_ == nullptr || (source_ && source_->is_good())) return;
  const bool again = source_ != nullptr;
  const Source* const before = source_.get();
  attach();
  if (again && source_.get() != before && problem_.empty()) {
    spdlog::info("reference clock '{}' was made anew and is followed again", name_);
  }
}

void ReferenceMemory::attach() {
  std::optional<ReferenceClockRecord> record;
  std::string problem;
  if (auto opened = ReferenceClockRecord::open(pool_, name_)) {
    record.emplace(*std::move(opened));
  } else {
    problem = opened.error().describe();
  }
  // A source without a record says nothing, which the clock takes for a reference that is silent.
  if (record || !source_ || source_->has_record()) {
    auto source = std::make_unique<Source>(std::move(record));
    if (!clock_->use_source(source.get())) return;  // a task is caught at the one before: the next time
    source_ = std::move(source);                    // nobody is at the one before any more
  }
  tell(std::move(problem));
}

void ReferenceMemory::tell(std::string problem) {
  if (!problem.empty() && problem != problem_) spdlog::error("{}; the clock runs freely", problem);
  problem_ = std::move(problem);
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
