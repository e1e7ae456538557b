#include "instances/runtime/time/reference_memory.hpp"

#include <optional>
#include <utility>

#include "shm/log/log.hpp"
#include "shm/pages/reference_clock.hpp"

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

ReferenceMemory::ReferenceMemory(DistributedClock& clock, std::string pool, std::string name)
    : Reference(clock), pool_(std::move(pool)), name_(std::move(name)) {
  attach();
}
ReferenceMemory::~ReferenceMemory() = default;

void ReferenceMemory::refresh() {
  if (source_ && source_->is_good()) return;
  const bool again = source_ != nullptr;
  const Source* const before = source_.get();
  attach();
  if (again && source_.get() != before && problem().empty()) {
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
    if (!clock().use_source(source.get())) return;  // a task is caught at the one before: the next time
    source_ = std::move(source);                    // nobody is at the one before any more
  }
  tell(std::move(problem));
}

}  // namespace plchost
