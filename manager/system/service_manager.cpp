#include "manager/system/service_manager.hpp"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <deque>
#include <iterator>
#include <memory>
#include <string>
#include <string_view>

#include <fmt/format.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <systemd/sd-bus.h>
#include <systemd/sd-daemon.h>

#include "manager/system/disk_thread.hpp"
#include "shm/base/time.hpp"
#include "shm/base/unique_fd.hpp"

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

Result<bool> ask_whether_restarted() {
  PLCHOST_TRY_ASSIGN(const auto bus, open_bus());
  PLCHOST_TRY_ASSIGN(const auto unit, own_unit(bus.get()));
  PLCHOST_TRY_ASSIGN(const auto job, job_of(bus.get(), unit));
  if (job.empty()) return false;
  PLCHOST_TRY_ASSIGN(const auto kind, kind_of(bus.get(), job));
  return kind == "restart";
}

/// Messages that the service manager has not taken yet, in their order. The manager's own thread.
std::deque<std::string> unsent;  // NOLINT(cert-err58-cpp)

// As sd_notify(3), but that waits while the other end does not read. True also if nobody is to be told.
bool is_taken(std::string_view state) noexcept {
  const char* const path = std::getenv("NOTIFY_SOCKET");
  sockaddr_un address{};
  const std::string_view name = path == nullptr ? "" : path;
  if (name.size() < 2 || name.size() >= sizeof address.sun_path || (name[0] != '/' && name[0] != '@'))
    return true;
  address.sun_family = AF_UNIX;
  const std::size_t marks = name[0] == '@' ? 1 : 0;  // in its place, there is a zero
  std::ranges::copy(name.substr(marks), std::begin(address.sun_path) + marks);
  const UniqueFd socket(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  if (!socket) return true;
  const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + name.size());
  const ssize_t sent = ::sendto(socket.get(), state.data(), state.size(), MSG_DONTWAIT | MSG_NOSIGNAL,
                                reinterpret_cast<const sockaddr*>(&address), size);
  return sent >= 0 || errno != EAGAIN;
}

}  // namespace

void notify_service_manager(const std::string& state) {
  constexpr std::size_t kMost = 32;
  if (unsent.size() < kMost) unsent.push_back(state);
  notify_of_the_rest();
}

void notify_of_the_rest() {
  while (!unsent.empty() && is_taken(unsent.front())) unsent.pop_front();
}

void notify_reloading() {
  const std::int64_t now_us =
      std::chrono::duration_cast<std::chrono::microseconds>(MonotonicClock::now().time_since_epoch()).count();
  notify_service_manager(fmt::format("RELOADING=1\nMONOTONIC_USEC={}", now_us));
}

Result<bool> is_being_restarted() {
  if (std::getenv("INVOCATION_ID") == nullptr) return false;
  // sd-bus has no limit for the time in which the other end greets.
  constexpr Duration kPatience = std::chrono::seconds(2);
  auto answer = DiskThread().ask<Result<bool>>(kPatience, "systemd", [] { return ask_whether_restarted(); });
  if (answer) return *std::move(answer);
  return failure(ErrorCode::timed_out, "systemd has not answered over D-Bus within 2 s");
}

ServiceWatchdog::ServiceWatchdog() noexcept {
  std::uint64_t limit_us = 0;
  // Half of the limit, as sd_watchdog_enabled(3) advises.
  if (::sd_watchdog_enabled(0, &limit_us) > 0) every_ = std::chrono::microseconds(limit_us / 2);
}

void ServiceWatchdog::feed(TimePoint now) noexcept {
  if (every_ == Duration::zero() || now < next_) return;
  next_ = now + every_;
  (void)is_taken("WATCHDOG=1");
}

}  // namespace plchost
