#include "schedulers/tick/tick_source.hpp"

#include <utility>

#include <fmt/format.h>

#include "schedulers/tasks/activation_gate.hpp"
#include "schedulers/tick/auxiliary_tick.hpp"

namespace plchost {

namespace {

/// The grid of the ticks: which of them is the last that has passed.
class TickGrid {
 public:
  void start(TimePoint first, Duration period) noexcept {
    next_ = first;
    period_ = period;
  }
  [[nodiscard]] TimePoint next() const noexcept { return next_; }
  /// `now` is not before next().
  [[nodiscard]] TimePoint take(TimePoint now) noexcept {
    const TimePoint tick = next_ + (now - next_) / period_ * period_;
    next_ = tick + period_;
    return tick;
  }

 private:
  TimePoint next_;
  Duration period_{1};
};

/// The system's clock: a periodic timer of the kernel.
class SystemTick final : public TickSource {
 public:
  SystemTick(Clock& clock, std::unique_ptr<PeriodicTimer> timer) noexcept
      : clock_(clock), timer_(std::move(timer)) {}

  void start(TimePoint first, Duration period) noexcept override {
    grid_.start(first, period);
    timer_->start(first, period);
  }
  std::optional<TimePoint> wait() noexcept override {
    while (timer_->wait() != 0) {
      if (const TimePoint now = clock_.now(); now >= grid_.next()) return grid_.take(now);
    }
    return std::nullopt;
  }
  void interrupt() noexcept override { timer_->interrupt(); }

 private:
  Clock& clock_;
  std::unique_ptr<PeriodicTimer> timer_;
  TickGrid grid_;
};

/// A thread of high priority in absolute sleeps.
class TaskTick final : public TickSource {
 public:
  explicit TaskTick(Clock& clock) noexcept : clock_(clock) {}

  void start(TimePoint first, Duration period) noexcept override { grid_.start(first, period); }
  std::optional<TimePoint> wait() noexcept override {
    if (gate_.wait(clock_, grid_.next()) != ActivationGate::Outcome::timed_out) return std::nullopt;
    return grid_.take(clock_.now());
  }
  void interrupt() noexcept override { gate_.interrupt(clock_); }

 private:
  Clock& clock_;
  ActivationGate gate_;
  TickGrid grid_;
};

}  // namespace

Result<std::unique_ptr<TickSource>> make_tick_source(Clock& clock, const TickChoice& choice) {
  if (choice.kind == TickSourceKind::task) return std::make_unique<TaskTick>(clock);
  PLCHOST_TRY_ASSIGN(auto timer, clock.make_periodic_timer());
  auto system = std::make_unique<SystemTick>(clock, std::move(timer));
  if (choice.kind == TickSourceKind::system) return system;
  return std::make_unique<AuxiliaryTick>(clock, choice.device, std::move(system));
}

namespace {

Result<std::shared_ptr<TickDevice>> device_for(const SchedulerSettings& settings, DeviceFiles& files,
                                               const std::shared_ptr<TickDevice>& known) {
  auto device = known;
  if (!device || device->path() != settings.auxiliary_device) {
    PLCHOST_TRY_ASSIGN(device, TickDevice::open(files, settings.auxiliary_device));
  }
  PLCHOST_TRY(device->set_period(settings.scheduler_interval));
  return device;
}

}  // namespace

TickChoice choose_tick(const SchedulerSettings& settings, DeviceFiles& files,
                       const std::shared_ptr<TickDevice>& known) {
  TickChoice choice{.kind = settings.tick_source, .device = {}, .fallback = {}};
  if (settings.tick_source != TickSourceKind::auxiliary) return choice;
  auto device = device_for(settings, files, known);
  if (!device) {
    choice.kind = TickSourceKind::system;
    choice.fallback = device.error().describe();
    return choice;
  }
  choice.device = *std::move(device);
  return choice;
}

Result<void> check_one_shot(std::string_view scheduler, const TickChoice& choice) {
  if (choice.kind != TickSourceKind::auxiliary) return {};
  return failure(
      ErrorCode::unsupported,
      fmt::format("{} sets its timer to another time in each cycle, but {} only has frequencies {} and ticks "
                  "only periodically: use the timer source System or Task",
                  scheduler, choice.device->path(), choice.device->frequencies()));
}

TickReport report_of(const TickChoice& choice) {
  if (choice.kind == TickSourceKind::task) return {.source = "Task", .fallback = {}};
  if (choice.kind == TickSourceKind::system) return {.source = "System", .fallback = choice.fallback};
  const TickFault fault = choice.device->fault();
  if (fault == TickFault::none) return {.source = choice.device->describe(), .fallback = {}};
  return {.source = "System", .fallback = fmt::format("{} {}", choice.device->path(), to_string(fault))};
}

}  // namespace plchost
