// Recordings of variables as CSV.
#include <algorithm>
#include <functional>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "api/library/calls.hpp"
#include "api/library/convert.hpp"
#include "api/library/variables.hpp"
#include "api/library/watcher.hpp"
#include "api/library/worker.hpp"
#include "api/recording/variable_recording.hpp"

namespace plchost {

namespace {

constexpr std::chrono::milliseconds kMaxDuration = std::chrono::seconds(1'000'000'000);

Async<Result<std::string>> host_in_turn(CallOrder& order, ClientCore& core, std::string host) {
  PLCHOST_CO_TRY_ASSIGN(const auto place, co_await order.place(core, host));
  co_return place.host;
}

/// The variables of one instance, for the thread of a call: another thread asks for them, so that no other
/// call holds up a sample.
class Recorded {
 public:
  struct Group {
    std::string host;
    std::string instance;
    VariableQuery query;
    Duration timeout;  // of each sample
  };

  /// `goes_on`: asked while it waits; empty: nobody is.
  Recorded(Sampling& sampling, Group group, const std::function<bool()>& goes_on)
      : sampling_(sampling), group_(std::move(group)), goes_on_(goes_on) {}

  [[nodiscard]] Result<VariableListing> sample(TimePoint latest) {
    const TimePoint deadline = std::min<TimePoint>(MonotonicClock::now() + group_.timeout, latest);
    auto page = answer_of<Result<VariableListing>>(
        [group = group_, deadline](ClientCore& core, const Answer<Result<VariableListing>>& answer) {
          return ask(core, answer, group, deadline);
        });
    if (page) return *std::move(page);
    return client_has_ended();
  }
  /// False: the client ends before, or its caller has enough.
  [[nodiscard]] bool sleep_until(TimePoint end) {
    if (has_enough_) return false;
    return answer_of<bool>(
               [end](ClientCore& core, const Answer<bool>& answer) { return sleep(core, answer, end); })
        .has_value();
  }

  [[nodiscard]] bool has_enough() const noexcept { return has_enough_; }

 private:
  template <class T>
  using Answer = std::shared_ptr<std::promise<T>>;

  static Async<Sampling::Over> ask(ClientCore& core, Answer<Result<VariableListing>> answer, Group group,
                                   TimePoint deadline) {
    auto page = co_await core.list_variables(group.host, group.instance, group.query, deadline);
    if (page) page = sample_in(*std::move(page), group.instance, group.query);
    answer->set_value(std::move(page));
    co_return Sampling::Over();
  }
  static Async<Sampling::Over> sleep(ClientCore& core, Answer<bool> answer, TimePoint end) {
    Pump::Hold pause(core.pump());
    while (MonotonicClock::now() < end) co_await pause.released(end);
    answer->set_value(true);
    co_return Sampling::Over();
  }

  // The thread of the samples has the only reference to the answer: it is gone without a value if the client
  // ends.
  template <class T, class Asking>
  [[nodiscard]] std::optional<T> answer_of(Asking asking) {
    auto answer = std::make_shared<std::promise<T>>();
    auto future = answer->get_future();
    sampling_.begin([asking = std::move(asking), answer = std::move(answer)](ClientCore& core) {
      return asking(core, answer);
    });
    constexpr auto kNextQuestion = std::chrono::milliseconds(100);
    while (future.wait_for(kNextQuestion) == std::future_status::timeout) {
      if (goes_on_ && !goes_on_()) {
        has_enough_ = true;
        return std::nullopt;
      }
    }
    try {
      return future.get();
    } catch (const std::future_error&) {
      return std::nullopt;
    }
  }

  Sampling& sampling_;
  Group group_;
  const std::function<bool()>& goes_on_;
  bool has_enough_ = false;
};

void check_options(const Client::RecordOptions& options) {
  check_sample_interval(options.interval);
  if (options.duration.count() >= 0 && options.duration <= kMaxDuration) return;
  throw_client_error(
      {ErrorCode::invalid_argument, 0,
       fmt::format("duration {} ms: allowed are 0 to {}", options.duration.count(), kMaxDuration.count())});
}

[[noreturn]] void refuse(const char* text) {
  throw_client_error({ErrorCode::invalid_argument, 0, text});
}

}  // namespace

unsigned long long Client::record_variables(const std::string& host, const std::string& instance,
                                            const std::vector<std::string>& patterns,
                                            const RecordOptions& options, const std::string& file) {
  if (file.empty()) refuse("name the file of the recording");
  if (options.duration.count() == 0 && options.count == 0)
    refuse("say the duration of the recording, or the count of its samples");
  RecordingFile taken(file);
  return record_variables(host, instance, patterns, options, [&](const std::string& lines) {
    if (const auto written = taken.write(lines); !written) throw_client_error(written.error());
    return true;
  });
}

unsigned long long Client::record_variables(const std::string& host, const std::string& instance,
                                            const std::vector<std::string>& patterns,
                                            const RecordOptions& options, const RecordSink& sink) {
  check_callback(static_cast<bool>(sink));
  check_options(options);
  const VariableQuery query = checked_query(patterns);
  if (const auto ours = worker_->maker().check(); !ours) throw_client_error(ours.error());
  if (worker_->is_here() || watcher_->sampling().is_here()) {
    throw_client_error(
        {ErrorCode::wrong_state, 0, "a callback cannot record variables: it would hold up those behind it"});
  }
  const auto place = value_or_throw(worker_->run<std::string>(
      [&](ClientCore& core) { return host_in_turn(worker_->order(), core, host); }));
  Recorded recorded(watcher_->sampling(), {place, instance, query, worker_->order().timeout()},
                    options.goes_on);
  SampleTimes times{.interval = options.interval};
  if (options.duration.count() > 0) times.until = MonotonicClock::now() + options.duration;
  RecordingText text;
  unsigned long long samples = 0;
  Error silence;
  bool has_ended = false;
  const auto use = [&](const VariableListing& sample) {
    const bool goes_on = sink(value_or_throw(text.lines_of(sample)));
    return ++samples != options.count && goes_on && (!options.goes_on || options.goes_on());
  };
  const auto sleep = [&](TimePoint next) {
    has_ended = !recorded.sleep_until(next);
    return !has_ended;
  };
  const auto answered =
      sample_again_and_again(times, {.sample = [&](TimePoint latest) { return recorded.sample(latest); },
                                     .use = use,
                                     .sleep_until = sleep,
                                     .tell_silence = [&](const Error& error) { silence = error; }});
  if (recorded.has_enough()) return samples;
  if (has_ended) throw_client_error(client_has_ended().error());
  if (!value_or_throw(answered)) throw_client_error(silence);
  return samples;
}

}  // namespace plchost
