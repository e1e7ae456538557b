#include "instances/io/modbus/modbus_process.hpp"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <span>
#include <utility>

#include <fmt/format.h>
#include <poll.h>

#include "instances/io/modbus/config/endpoint.hpp"
#include "shm/base/names.hpp"
#include "shm/log/log.hpp"

namespace plchost::modbus {

namespace {

using std::chrono::milliseconds;

constexpr milliseconds kShow{50};          // how fine the ages are
constexpr milliseconds kRepairPause{500};  // images whose file was removed
// At first a device that answers puts its outputs into their safe state; a thread on TCP that still waits
// for another response then is interrupted. The devices of a serial line or of one connection take turns, and
// outputs of many requests take their time: they go on up to kLineTime.
constexpr milliseconds kSafeStateTime{600};
constexpr milliseconds kInterruptTime{700};  // for a connection and a response, of 300 ms each
constexpr milliseconds kLineTime{10'000};
constexpr milliseconds kStillAnswers{700};  // since a response: the next one comes before, or never

// Devices with the same one take turns.
std::string line_of(const DeviceConfig& device) {
  if (!device.serial.empty()) return device.serial;
  const auto endpoint = parse_endpoint(device.tcp);
  return device.share_connection && endpoint ? endpoint->text() : "tcp " + device.name;
}

}  // namespace

Result<std::unique_ptr<ModbusProcess>> ModbusProcess::create(const ModbusConfig& config) {
  PLCHOST_TRY_ASSIGN(auto stop, StopEvent::make());
  PLCHOST_TRY_ASSIGN(auto images, ImageTable::open(config.process.pool, config.images));
  std::unique_ptr<ModbusProcess> process(new ModbusProcess(config, std::move(stop), std::move(images)));
  PLCHOST_TRY(process->add_devices());
  if (config.server) {
    PLCHOST_TRY_ASSIGN(process->server_, Server::listen(*config.server, process->images_, process->stop_));
  }
  return process;
}

ModbusProcess::~ModbusProcess() {
  if (!threads_.empty()) (void)stop();
}

Result<void> ModbusProcess::add_devices() {
  for (const DeviceConfig& device : config_.devices) {
    auto& line = lines_[line_of(device)];
    if (!line) {
      PLCHOST_TRY_ASSIGN(line, Link::make(device, stop_));
      PLCHOST_TRY(line->claim(device));
    }
    devices_.push_back(std::make_unique<Device>(device, *line, images_, stop_));
    show_at_end(*devices_.back());
    if (!device.tcp.empty() && !device.writes.empty()) {
      PLCHOST_TRY_ASSIGN(auto claim, OutputsClaim::take(config_.process.pool, device));
      outputs_.push_back({.claim = std::move(claim), .device = devices_.back().get()});
    }
  }
  return {};
}

// The same as after an end in order.
void ModbusProcess::show_at_end(const Device& device) {
  for (const auto& [name, image] : images_.inputs()) {
    image->at_end([&device, shown = image.get()](std::span<std::byte> bytes) {
      device.show(*shown, bytes, MonotonicClock::now(), true);
    });
  }
}

Result<void> ModbusProcess::start_threads() {
  for (const auto& device : devices_) {
    PLCHOST_TRY_ASSIGN(auto thread, Thread::start(device->name(), {}, [&device] { device->run(); }));
    threads_.push_back(std::move(thread));
  }
  if (server_) {
    PLCHOST_TRY_ASSIGN(auto thread, Thread::start("server", {}, [this] { server_->run(); }));
    threads_.push_back(std::move(thread));
    spdlog::info("the server listens at {}", config_.server->listen);
  }
  return {};
}

Result<void> ModbusProcess::run(int signals) {
  show(MonotonicClock::now(), false);  // the first status of each device, before it is polled
  PLCHOST_TRY(start_threads());
  spdlog::info("{}, {}", count_text(devices_.size(), "device"), count_text(config_.images.size(), "image"));
  pollfd signal{.fd = signals, .events = POLLIN, .revents = 0};
  while (::poll(&signal, 1, static_cast<int>(kShow.count())) == 0 || errno == EINTR) {
    if (signal.revents != 0) break;
    const TimePoint now = MonotonicClock::now();
    for (const auto& device : devices_) device->count();
    show(now, false);
    repair(now);
  }
  spdlog::info("a signal asks for the end");
  return {};
}

bool ModbusProcess::join_until(TimePoint deadline) {
  bool ended = true;
  for (Thread& thread : threads_) ended = thread.join_until(deadline, [] { return false; }) && ended;
  return ended;
}

bool ModbusProcess::answers() const {
  const TimePoint since = MonotonicClock::now() - kStillAnswers;
  return std::ranges::any_of(lines_,
                             [&](const auto& line) { return line.second->answered_at_end() > since; });
}

bool ModbusProcess::stop() {
  stop_.set();
  const TimePoint now = MonotonicClock::now();
  bool ended = join_until(now + kSafeStateTime);
  if (!ended) {
    for (const auto& [name, line] : lines_) line->interrupt();
    ended = join_until(now + kSafeStateTime + kInterruptTime);
  }
  const auto at_line = [](const DeviceConfig& device) { return !device.serial.empty(); };
  const bool take_turns =
      std::ranges::any_of(config_.devices, at_line) || lines_.size() < config_.devices.size();
  while (!ended && MonotonicClock::now() < now + kLineTime && (take_turns || answers())) {
    show(MonotonicClock::now(), true);
    ended = join_until(std::min(MonotonicClock::now() + kShow, now + kLineTime));
  }
  for (const auto& device : devices_) {
    if (!ended && !device->has_ended())
      spdlog::warn("device '{}' has not ended in time: its outputs may stay as they are", device->name());
  }
  show(MonotonicClock::now(), true);
  for (const auto& [name, image] : images_.inputs()) image->end();
  if (ended) threads_.clear();
  return ended;
}

void ModbusProcess::show(TimePoint now, bool ended) {
  for (const auto& [name, image] : images_.inputs()) {
    image->update([&](std::span<std::byte> bytes) {
      for (const auto& device : devices_) device->show(*image, bytes, now, ended);
    });
  }
}

void ModbusProcess::repair(TimePoint now) {
  if (now < repaired_at_ + kRepairPause) return;
  repaired_at_ = now;
  for (const auto& [name, image] : images_.inputs()) {
    const auto repaired = image->repair();
    if (!repaired && repair_pause_.is_over(now)) spdlog::error("{}", repaired.error().describe());
  }
  for (ClaimedOutputs& outputs : outputs_) {
    const auto repaired = outputs.claim.repair();
    outputs.device->yield_outputs(!repaired && repaired.error().code == ErrorCode::busy);
    if (!repaired && repair_pause_.is_over(now)) spdlog::error("{}", repaired.error().describe());
  }
}

}  // namespace plchost::modbus
