// The watch of variables: it samples them at its rate.
#include <algorithm>
#include <memory>
#include <string>
#include <utility>

#include "api/library/calls.hpp"
#include "api/library/convert.hpp"
#include "api/library/variables.hpp"
#include "api/library/watcher.hpp"
#include "api/library/worker.hpp"
#include "shm/base/next_on_grid.hpp"

namespace plchost {

namespace {

constexpr auto kLookIfStopped = std::chrono::seconds(1);

Client::Sampled sampled_of(Result<Client::Sample> sample) {
  if (sample) return {.code = 0, .text = {}, .sample = *std::move(sample)};
  return {.code = static_cast<int>(sample.error().code), .text = sample.error().describe(), .sample = {}};
}

}  // namespace

class __attribute__((visibility("hidden"))) Client::VariablesWatch final
    : public Client::Watch::Subscription {
 public:
  struct Group {
    std::string host;  // empty: the only one
    std::string instance;
    VariableQuery query;
    Duration interval;
    Duration timeout;  // of each sample
  };

  VariablesWatch(Group group, std::function<void(const Sampled&)> callback)
      : group_(std::move(group)), callback_(std::move(callback)) {}

  /// Until it is stopped. `own`: it stays until then.
  static Async<Sampling::Over> ask(ClientCore& core, std::shared_ptr<VariablesWatch> own) {
    Pump::Hold pause(core.pump());
    for (TimePoint next = MonotonicClock::now(); !own->stopped();) {
      own->tell(sampled_of(co_await own->sample(core)));
      next = next_on_grid(next, MonotonicClock::now(), own->group_.interval);
      for (TimePoint now = MonotonicClock::now(); now < next && !own->stopped(); now = MonotonicClock::now())
        co_await pause.released(std::min<TimePoint>(next, now + kLookIfStopped));
    }
    co_return Sampling::Over();
  }

 private:
  Async<Result<Sample>> sample(ClientCore& core) {
    const TimePoint deadline = MonotonicClock::now() + group_.timeout;
    PLCHOST_CO_TRY_ASSIGN(group_.host, co_await host_of(core, group_.host, deadline));
    co_return co_await read_sample(core, group_.host, group_.instance, group_.query, deadline);
  }

  void tell(const Sampled& sampled) {
    const bool is_known = !sampled && std::exchange(failure_, sampled.text) == sampled.text;
    if (sampled) failure_.clear();
    if (!is_known) unless_stopped([&] { callback_(sampled); });
  }

  Group group_;
  std::function<void(const Sampled&)> callback_;
  std::string failure_;  // that was told last, and is still so
};

Client::Watch Client::watch_variables(const std::string& host, const std::string& instance,
                                      const std::vector<std::string>& patterns,
                                      std::chrono::milliseconds interval,
                                      std::function<void(const Sampled&)> callback) {
  check_callback(static_cast<bool>(callback));
  check_sample_interval(interval);
  const VariableQuery query = checked_query(patterns);
  if (!host.empty()) worker_->check_watched(host);
  if (const auto ours = worker_->maker().check(); !ours) throw_client_error(ours.error());
  auto watch = std::make_shared<VariablesWatch>(
      VariablesWatch::Group{host, instance, query, interval, worker_->order().timeout()},
      std::move(callback));
  watcher_->sampling().begin([watch](ClientCore& core) { return VariablesWatch::ask(core, watch); });
  return Watch(std::move(watch));
}

}  // namespace plchost
