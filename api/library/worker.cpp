#include "api/library/worker.hpp"

#include <optional>

#include <fmt/format.h>

#include "api/client/check_names.hpp"
#include "api/library/convert.hpp"

namespace plchost {

namespace {

constexpr std::chrono::milliseconds kMaxTimeout = std::chrono::hours(1);

Duration checked_timeout(std::chrono::milliseconds timeout) {
  if (timeout >= std::chrono::milliseconds(1) && timeout <= kMaxTimeout) return timeout;
  throw_client_error(
      {ErrorCode::invalid_argument, 0,
       fmt::format("timeout {} ms: allowed are 1 to {}", timeout.count(), kMaxTimeout.count())});
}

std::unexpected<Error> too_many(std::size_t most) {
  return failure(
      ErrorCode::full,
      fmt::format("{} calls of this client are under way already: wait for some of them to end", most));
}

}  // namespace

Client::Worker::Worker(const Options& options, std::shared_ptr<ParticipantSource> participant)
    : connection_(std::move(participant), options.host),
      order_(checked_timeout(options.timeout)),
      only_(options.host) {
  // Here, where it can be said at once.
  if (!only_.empty()) check_watched(only_);
  if (const auto good = dds::domain_configuration(dds::Role::client, domain_options(options)); !good) {
    throw_client_error(good.error());
  }
  thread_ = quiet_thread([this] { work(); });
}

void Client::Worker::end() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
    order_.end();
    wake();
  }
  if (thread_.joinable()) thread_.join();
}

void Client::Worker::wake() {
  changed_.notify_all();
  if (client_ != nullptr) client_->wake();
}

void Client::Worker::begin(Job job) {
  const auto refuse = [&](std::unexpected<Error> why) { job(why).start(); };
  if (const auto ours = maker_.check(); !ours) return refuse(std::unexpected(ours.error()));
  bool ending = false;
  {
    const std::lock_guard lock(mutex_);
    ending = ending_;
    if (!ending && calls_ < kMaxCalls) {
      jobs_.push_back(std::move(job));
      ++calls_;
      return wake();
    }
  }
  refuse(ending ? client_has_ended() : too_many(kMaxCalls));
}

void Client::Worker::check_watched(const std::string& host) const {
  if (const auto good = check_host_name(host, only_); !good) throw_client_error(good.error());
}

bool Client::Worker::is_ending() {
  const std::lock_guard lock(mutex_);
  return ending_;
}

Result<ControlClient*> Client::Worker::connect() {
  PLCHOST_TRY_ASSIGN(ControlClient* const client, connection_.client());
  const std::lock_guard lock(mutex_);
  client_ = client;
  return client;
}

// A call may end, and be told, within this.
bool Client::Worker::begin_next() {
  Job job;
  {
    const std::lock_guard lock(mutex_);
    if (jobs_.empty()) return false;
    job = std::move(jobs_.front());
    jobs_.pop_front();
  }
  const auto client = is_ending() ? Result<ControlClient*>(client_has_ended()) : connect();
  under_way_.push_back(job(client));
  under_way_.back().start();
  return true;
}

bool Client::Worker::step() {
  while (begin_next()) {
  }
  const std::size_t over = std::erase_if(under_way_, [](auto& call) {
    if (call.done()) (void)call.take();  // the exception of a callback ends the program
    return call.done();
  });
  {
    const std::lock_guard lock(mutex_);
    calls_ -= over;
  }
  if (under_way_.empty()) return false;
  client_->core().pump().round(TimePoint::max());
  return true;
}

void Client::Worker::work() {
  for (;;) {
    if (step()) continue;
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return ending_ || !jobs_.empty(); });
    if (jobs_.empty()) return;
  }
}

}  // namespace plchost
