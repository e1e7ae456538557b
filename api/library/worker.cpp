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

Result<ControlClient*> ended() {
  return failure(ErrorCode::unavailable, "the client has ended");
}

Result<ControlClient*> too_many(std::size_t most) {
  return failure(ErrorCode::full,
                 fmt::format("{} calls of this client wait already: wait for some of them to end", most));
}

}  // namespace

Client::Worker::Worker(const Options& options, std::shared_ptr<ParticipantSource> participant)
    : connection_(std::move(participant), options.host),
      timeout_(checked_timeout(options.timeout)),
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
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
}

void Client::Worker::begin(Job job) {
  if (const auto ours = maker_.check(); !ours) return job(std::unexpected(ours.error()));
  bool ending = false;
  {
    const std::lock_guard lock(mutex_);
    ending = ending_;
    if (!ending && jobs_.size() < kMaxJobs) {
      jobs_.push_back(std::move(job));
      job = nullptr;
    }
  }
  if (job) return job(ending ? ended() : too_many(kMaxJobs));
  changed_.notify_all();
}

void Client::Worker::check_watched(const std::string& host) const {
  if (const auto good = check_host_name(host, only_); !good) throw_client_error(good.error());
}

Result<ControlClient*> Client::Worker::busy() {
  return failure(
      ErrorCode::wrong_state,
      "a progress callback cannot wait for a call: a download is under way; use the functions with "
      "a callback");
}

Client::Progress Client::Worker::refusing(const Progress& progress) {
  if (!progress) return {};
  return [this, progress](unsigned long long received) {
    struct Telling {
      bool& mark;
      explicit Telling(bool& set) noexcept : mark(set) { mark = true; }
      ~Telling() { mark = false; }
      Telling(const Telling&) = delete;
      Telling& operator=(const Telling&) = delete;
    };
    const Telling telling(telling_);
    progress(received);
  };
}

void Client::Worker::work() {
  for (;;) {
    Job job;
    bool ending = false;
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [this] { return ending_ || !jobs_.empty(); });
      if (jobs_.empty()) return;
      job = std::move(jobs_.front());
      jobs_.pop_front();
      ending = ending_;
    }
    job(ending ? ended() : connection_.client());
  }
}

}  // namespace plchost
