#include "manager/system/service_manager.hpp"

#include <chrono>
#include <cinttypes>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <string>

#include <systemd/sd-bus.h>
#include <systemd/sd-daemon.h>

#include "shm/base/time.hpp"

namespace plchost {

namespace {

constexpr const char* kSystemd = "org.freedesktop.systemd1";

struct EndBus {
  void operator()(sd_bus* bus) const noexcept { ::sd_bus_flush_close_unref(bus); }
};
struct EndMessage {
  void operator()(sd_bus_message* message) const noexcept { ::sd_bus_message_unref(message); }
};
using Bus = std::unique_ptr<sd_bus, EndBus>;
using Message = std::unique_ptr<sd_bus_message, EndMessage>;

Result<void> check_answer(int code) {
  if (code >= 0) return {};
  return failure(ErrorCode::unavailable, "systemd does not answer over D-Bus", -code);
}

Result<Bus> open_bus() {
  constexpr std::uint64_t kPatienceUs = 1'000'000;
  sd_bus* made = nullptr;
  PLCHOST_TRY(check_answer(::sd_bus_open_system(&made)));
  Bus bus(made);
  PLCHOST_TRY(check_answer(::sd_bus_set_method_call_timeout(made, kPatienceUs)));
  return bus;
}

// The path of the unit that this process belongs to.
Result<std::string> own_unit(sd_bus* bus) {
  sd_bus_message* answered = nullptr;
  PLCHOST_TRY(check_answer(::sd_bus_call_method(  // NOLINT: variadic
      bus, kSystemd, "/org/freedesktop/systemd1", "org.freedesktop.systemd1.Manager", "GetUnitByPID", nullptr,
      &answered, "u", 0U)));
  const Message answer(answered);
  const char* path = nullptr;
  PLCHOST_TRY(check_answer(::sd_bus_message_read(answered, "o", &path)));  // NOLINT: variadic
  return std::string(path);
}

// The path of the unit's job; empty: it has none.
Result<std::string> job_of(sd_bus* bus, const std::string& unit) {
  sd_bus_message* answered = nullptr;
  PLCHOST_TRY(check_answer(::sd_bus_get_property(bus, kSystemd, unit.c_str(), "org.freedesktop.systemd1.Unit",
                                                 "Job", nullptr, &answered, "(uo)")));
  const Message answer(answered);
  std::uint32_t number = 0;
  const char* path = nullptr;
  PLCHOST_TRY(check_answer(::sd_bus_message_read(answered, "(uo)", &number, &path)));  // NOLINT: variadic
  return number == 0 ? std::string() : std::string(path);
}

Result<std::string> kind_of(sd_bus* bus, const std::string& job) {
  char* kind = nullptr;
  PLCHOST_TRY(check_answer(::sd_bus_get_property_string(
      bus, kSystemd, job.c_str(), "org.freedesktop.systemd1.Job", "JobType", nullptr, &kind)));
  const std::unique_ptr<char, decltype(&std::free)> owned(kind, &std::free);
  return std::string(kind);
}

}  // namespace

void notify_service_manager(const char* state) noexcept {
  ::sd_notify(0, state);
}

void notify_reloading() noexcept {
  const std::int64_t now_us =
      std::chrono::duration_cast<std::chrono::microseconds>(MonotonicClock::now().time_since_epoch()).count();
  ::sd_notifyf(0, "RELOADING=1\nMONOTONIC_USEC=%" PRIi64, now_us);  // NOLINT: variadic
}

Result<bool> is_being_restarted() {
  if (std::getenv("INVOCATION_ID") == nullptr) return false;
  PLCHOST_TRY_ASSIGN(const auto bus, open_bus());
  PLCHOST_TRY_ASSIGN(const auto unit, own_unit(bus.get()));
  PLCHOST_TRY_ASSIGN(const auto job, job_of(bus.get(), unit));
  if (job.empty()) return false;
  PLCHOST_TRY_ASSIGN(const auto kind, kind_of(bus.get(), job));
  return kind == "restart";
}

ServiceWatchdog::ServiceWatchdog() noexcept {
  std::uint64_t limit_us = 0;
  // Half of the limit, as sd_watchdog_enabled(3) advises.
  if (::sd_watchdog_enabled(0, &limit_us) > 0) every_ = std::chrono::microseconds(limit_us / 2);
}

void ServiceWatchdog::feed(TimePoint now) noexcept {
  if (every_ == Duration::zero() || now < next_) return;
  next_ = now + every_;
  notify_service_manager("WATCHDOG=1");
}

}  // namespace plchost
