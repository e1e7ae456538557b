#include "instances/runtime/time/host_reference.hpp"

#include <utility>

#include "shm/log/log.hpp"

namespace plchost {

HostReference::HostReference(DistributedClock& clock, ClockSystem& system, ReferenceName name,
                             Duration period)
    : Reference(clock), system_(system), name_(std::move(name)), period_(period) {
  attach();
  auto thread = Thread::start("reference", {}, [this] { run(); });
  if (thread) {
    thread_ = *std::move(thread);
  } else {
    note(thread.error().describe());
    refresh();
  }
}

HostReference::~HostReference() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
    wake_.notify_one();
  }
  thread_.join();
}

void HostReference::refresh() {
  if (!attached_) attach();
  std::string seen;
  {
    const std::lock_guard lock(mutex_);
    seen = seen_;
  }
  tell(std::move(seen));
}

void HostReference::attach() {
  attached_ = clock().use_source(&source_);
}

void HostReference::run() {
  Duration pause{};
  while (rest(pause)) {
    const auto read = read_clock();
    pause = read ? period_ : kAgain;
    note(read ? std::string() : read.error().describe());
  }
}

// A device that cannot be read is opened anew: its driver may have been loaded again.
Result<void> HostReference::read_clock() {
  const bool opens = !host_clock_;
  if (opens) {
    PLCHOST_TRY_ASSIGN(host_clock_, HostClock::open(system_, name_));
    widths_ = {};
  }
  const auto look = host_clock_->look();
  if (!look && look.error().code == ErrorCode::busy) return {};
  if (!look) {
    host_clock_.reset();
    return std::unexpected(look.error());
  }
  if (opens) spdlog::info("the grids follow {}", host_clock_->describe());
  if (widths_.takes(look->width)) source_.publish(look->pair);
  return {};
}

bool HostReference::rest(Duration time) {
  std::unique_lock lock(mutex_);
  return !wake_.wait_for(lock, time, [this] { return ending_; });
}

void HostReference::note(std::string problem) {
  const std::lock_guard lock(mutex_);
  seen_ = std::move(problem);
}

}  // namespace plchost
