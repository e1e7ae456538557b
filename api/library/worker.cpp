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
  if (const auto ours = maker_.check(); !ours) return job.fail(ours.error());
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
  job.fail((ending ? client_has_ended() : too_many(kMaxCalls)).error());
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

bool Client::Worker::has_jobs() {
  const std::lock_guard lock(mutex_);
  return !jobs_.empty();
}

void Client::Worker::free_place() {
  const std::lock_guard lock(mutex_);
  --calls_;
}

Client::Progress Client::Worker::in_turn(Progress progress) {
  if (!progress) return progress;
  struct State {
    Progress progress;
    unsigned long long bytes = 0;
    bool waits = false;
  };
  return [this, state = std::make_shared<State>(std::move(progress))](unsigned long long bytes) {
    state->bytes = bytes;
    if (std::exchange(state->waits, true)) return;
    to_tell_.emplace_back([state] {
      state->waits = false;
      state->progress(state->bytes);
    });
  };
}

void Client::Worker::begin_all() {
  std::deque<Job> jobs;
  {
    const std::lock_guard lock(mutex_);
    jobs.swap(jobs_);
  }
  for (Job& job : jobs) {
    const auto client = is_ending() ? Result<ControlClient*>(client_has_ended()) : connect();
    if (client) {
      job.start((*client)->core());
      continue;
    }
    tell(job.telling, [this, fail = std::move(job.fail), error = client.error()] {
      free_place();
      fail(error);
    });
  }
  forget_ended();
}

void Client::Worker::tell(Telling telling, std::function<void()> what) {
  if (telling == Telling::at_once) return what();
  to_tell_.push_back(std::move(what));
}

// Those that come meanwhile wait until the calls under way have gone on.
void Client::Worker::tell_all() {
  for (auto& tell : std::exchange(to_tell_, {})) tell();
}

void Client::Worker::forget_ended() {
  for (const auto call : std::exchange(over_, {})) {
    (void)call->take();  // an exception of it ends the program
    under_way_.erase(call);
  }
}

void Client::Worker::round(TimePoint deadline) {
  client_->core().pump().round(deadline);
  forget_ended();
}

bool Client::Worker::step() {
  begin_all();
  tell_all();
  if (under_way_.empty()) return !to_tell_.empty();
  // A callback that waited for a call may have taken the wake-up of another one.
  const bool has_more = !to_tell_.empty() || has_jobs();
  round(has_more ? TimePoint{} : TimePoint::max());
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
