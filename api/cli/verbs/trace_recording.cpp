#include "api/cli/verbs/trace_recording.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "api/cli/at_once.hpp"
#include "api/cli/interrupt.hpp"
#include "api/cli/own_file.hpp"
#include "api/cli/verbs/trace_reader.hpp"
#include "api/client/client_core_status.hpp"
#include "api/dds/object_query.hpp"
#include "api/dds/text.hpp"
#include "api/recording/trace_tracks.hpp"
#include "api/recording/variable_recording.hpp"
#include "shm/base/names.hpp"
#include "shm/base/next_on_grid.hpp"
#include "shm/pages/flight_page.hpp"

namespace plchost {

namespace {

constexpr std::string_view kAllInstances = "all";
constexpr Duration kMostTraceTime = std::chrono::hours(1);
// Rings have room for 2 s of 30 tasks that run once a millisecond.
constexpr Duration kTracePeriod = std::chrono::milliseconds(250);
constexpr Duration kTracePatience = std::chrono::seconds(1);
constexpr std::size_t kMostTraceEntries = 4'000'000;  // in memory until the file is written: some 100 MB
constexpr int kClockReadings = 8;

struct TraceArguments {
  std::vector<std::string> names;
  std::optional<std::string> duration;
  std::string file;
};

/// One instance that is recorded.
struct RecordedInstance {
  std::size_t host = 0;
  TraceReader reader;
  FlightRecording recording;
  std::optional<Error> ended = std::nullopt;  ///< asking again does not help
  bool silent = false;
};

/// Records the flight recorders of instances of one or more hosts.
class TraceRecorder {
 public:
  explicit TraceRecorder(CliSession& session) : session_(session) {}

  /// Finds the instances, and where their recorders are.
  Result<void> begin(const std::vector<std::string>& names) {
    PLCHOST_TRY_ASSIGN(client_, session_.client());
    PLCHOST_TRY_ASSIGN(const auto shown, session_.shown_hosts());
    PLCHOST_TRY(find(shown, names));
    read(session_.deadline());
    for (const RecordedInstance& source : sources_) {
      if (source.ended) return std::unexpected(*source.ended);
      if (source.silent) return std::unexpected(*last_error_);
    }
    read_clocks();
    read_events();
    return {};
  }

  /// Until then, or until Ctrl-C; the exit code.
  int record(TimePoint until) {
    TimePoint next = MonotonicClock::now();
    while (!interrupted() && MonotonicClock::now() < until && is_going_on()) {
      next = next_on_grid(next, MonotonicClock::now(), kTracePeriod);
      sleep_until_interrupted(std::min(next, until));
      read(MonotonicClock::now() + kTracePatience);
    }
    read_clocks();
    read_events();  // those that were made meanwhile
    const bool failed =
        std::ranges::any_of(sources_, [](const RecordedInstance& one) { return one.ended.has_value(); });
    const bool silent = std::ranges::any_of(sources_, [](const RecordedInstance& one) { return one.silent; });
    return failed ? kExitFailed : silent ? kExitNoAnswer : kExitDone;
  }

  Result<TraceCounts> write(OwnFile& file) {
    std::vector<HostRecording> hosts;
    for (std::size_t i = 0; i < hosts_.size(); ++i) {
      HostRecording& host = hosts.emplace_back();
      host.host = printable(hosts_[i].name);
      host.time = hosts_[i].clock.result().value_or(HostTime{});
      host.events = hosts_[i].events;
      for (RecordedInstance& source : sources_) {
        if (source.host == i) host.instances.push_back(std::move(source.recording));
      }
      tell_clock(host);
    }
    return write_trace(file, hosts);
  }

 private:
  struct Host {
    std::string name;
    HostTimeSamples clock;
    std::map<std::uint32_t, std::string> events;
  };

  Result<void> find(const std::vector<HostView>& shown, const std::vector<std::string>& names) {
    std::vector<bool> used(names.size());
    std::vector<std::string> known;
    for (const HostView& view : shown) {
      PLCHOST_TRY_ASSIGN(const auto instances, client_->instances(view.name, session_.deadline()));
      for (const plc_InstanceStatus& status : instances) {
        const std::string instance(dds::text_of(status.instance));
        known.push_back(instance);
        bool wanted = false;
        for (std::size_t i = 0; i < names.size(); ++i) {
          if (names[i] != kAllInstances && !matches_pattern(names[i], instance)) continue;
          used[i] = wanted = true;
        }
        if (!wanted) continue;
        if (hosts_.empty() || hosts_.back().name != view.name) hosts_.push_back({view.name, {}, {}});
        sources_.push_back({.host = hosts_.size() - 1,
                            .reader = TraceReader(view.name, instance),
                            .recording = FlightRecording(instance, status.core)});
      }
    }
    for (std::size_t i = 0; i < names.size(); ++i) {
      if (!used[i]) return unknown_name("instance", names[i], known);
    }
    return {};
  }

  void read(TimePoint deadline) {
    ClientCore& core = client_->core();
    (void)client_->wait(all_at_once(core.pump(), sources_.size(),
                                    [&](std::size_t i) { return read_one(core, sources_[i], deadline); }));
  }

  Async<bool> read_one(ClientCore& core, RecordedInstance& source, TimePoint deadline) {
    if (source.ended) co_return false;
    auto parts = co_await source.reader.read(core, deadline);
    if (!parts) {
      tell_failure(source, parts.error());
      co_return false;
    }
    source.silent = false;
    for (const TracePart& part : *parts) {
      hosts_[source.host].clock.add(part.asked, part.answered, part.listing.time_monotonic_ns);
      source.recording.add(part.listing);
    }
    co_return true;
  }

  void tell_failure(RecordedInstance& source, const Error& error) {
    last_error_ = error;
    if (!comes_back(error)) source.ended = error;
    if (!std::exchange(source.silent, true)) (void)CliSession::fail(error);
  }

  // Pages without entries come fastest.
  void read_clocks() {
    ClientCore& core = client_->core();
    (void)client_->wait(all_at_once(core.pump(), hosts_.size(), [&](std::size_t i) {
      return read_clock(core, i, MonotonicClock::now() + kTracePatience);
    }));
  }

  Async<bool> read_clock(ClientCore& core, std::size_t host, TimePoint deadline) {
    const auto source = std::ranges::find_if(
        sources_, [&](const RecordedInstance& one) { return one.host == host && !one.ended; });
    for (int i = 0; source != sources_.end() && i < kClockReadings; ++i) {
      const TimePoint asked = MonotonicClock::now();
      const auto page = co_await core.read_trace(hosts_[host].name, source->reader.instance(),
                                                 {.after = kAfterAllEntries}, deadline);
      if (!page) break;
      hosts_[host].clock.add(asked, MonotonicClock::now(), page->time_monotonic_ns);
    }
    co_return true;
  }

  // Without the name of an event, its track has its mark.
  void read_events() {
    for (Host& host : hosts_) {
      const auto events = client_->status<plc_EventStatus>(host.name, MonotonicClock::now() + kTracePatience);
      if (!events) continue;
      for (const plc_EventStatus& event : *events) {
        const std::string name = event_object_name(dds::text_of(event.instance), dds::text_of(event.event));
        host.events[event_mark(name)] = printable(name);
      }
    }
  }

  [[nodiscard]] bool is_going_on() const {
    std::size_t entries = 0;
    for (const RecordedInstance& source : sources_) entries += source.recording.entries();
    if (entries < kMostTraceEntries)
      return std::ranges::any_of(sources_, [](const RecordedInstance& source) { return !source.ended; });
    fmt::print(stderr, "plcctl: the recording ends with {} entries: record fewer instances for longer\n",
               entries);
    return false;
  }

  void tell_clock(const HostRecording& host) const {
    if (session_.options.quiet) return;
    constexpr double kNsPerUs = 1e3;
    const std::int64_t offset = host.time.offset_ns;
    fmt::print(stderr, "plcctl: the clock of host '{}' is {:.1f} us {} this one, +-{:.1f} us\n", host.host,
               std::abs(static_cast<double>(offset)) / kNsPerUs, offset < 0 ? "behind" : "ahead of",
               static_cast<double>(host.time.uncertainty_ns) / kNsPerUs);
  }

  static Result<TraceCounts> write_trace(OwnFile& file, const std::vector<HostRecording>& hosts) {
    constexpr std::size_t kBlock = 1 << 20;
    std::string waiting;
    Result<void> written;
    PerfettoTrace trace([&](std::string_view packet) {
      waiting += packet;
      if (waiting.size() < kBlock || !written) return;
      written = file.write(waiting);
      waiting.clear();
    });
    const TraceCounts counts = write_tracks(trace, hosts, clocks_here());
    if (written) written = file.write(waiting);
    PLCHOST_TRY(written);
    PLCHOST_TRY(file.put_in_place());
    return counts;
  }

  static TraceClocks clocks_here() {
    const std::int64_t monotonic = MonotonicClock::now().time_since_epoch().count();
    return {.boot_ns = static_cast<std::uint64_t>(boot_time_ns()),
            .monotonic_ns = static_cast<std::uint64_t>(monotonic),
            .unix_ns = static_cast<std::uint64_t>(std::max<std::int64_t>(unix_time_ns(), 0))};
  }

  CliSession& session_;
  ControlClient* client_ = nullptr;
  std::vector<Host> hosts_;
  std::vector<RecordedInstance> sources_;
  std::optional<Error> last_error_;
};

int record(CliSession& session, const TraceArguments& arguments) {
  const auto duration = parse_recording_time(arguments.duration.value_or("1h"));
  if (!duration) return CliSession::fail(duration.error());
  catch_interrupts();
  auto file = OwnFile::create(arguments.file);
  if (!file) return CliSession::fail(file.error());
  TraceRecorder recorder(session);
  if (const auto begun = recorder.begin(arguments.names); !begun) return CliSession::fail(begun.error());
  const int code = recorder.record(MonotonicClock::now() + *duration);
  const auto counts = recorder.write(*file);
  if (!counts) return CliSession::fail(counts.error());
  if (counts->missing > 0) {
    fmt::print(stderr, "plcctl: {} missing: they were written over before they were read\n",
               count_text(counts->missing, "entry is", "entries are"));
  }
  if (counts->damaged > 0) {
    fmt::print(stderr, "plcctl: {} left out: no flight recorder writes such\n",
               count_text(counts->damaged, "entry is", "entries are"));
  }
  session.say(fmt::format("{} and {} from a post to its cycle in {}", count_text(counts->cycles, "cycle"),
                          count_text(counts->flows, "flow"), shown(arguments.file)));
  return code;
}

}  // namespace

Result<Duration> parse_recording_time(std::string_view text) {
  struct Unit {
    std::string_view word;
    double seconds;
  };
  constexpr std::array kUnits{Unit{"", 1}, Unit{"s", 1}, Unit{"ms", 1e-3}, Unit{"m", 60}, Unit{"h", 3600}};
  double number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  const auto unit = std::ranges::find(kUnits, std::string_view(end, text.data() + text.size()), &Unit::word);
  const double seconds = error == std::errc{} && unit != kUnits.end() ? number * unit->seconds : 0;
  const double most = std::chrono::duration<double>(kMostTraceTime).count();
  if (!(seconds > 0 && seconds <= most)) {
    return failure(
        ErrorCode::invalid_argument,
        fmt::format("--duration '{}': allowed are 5s, 500ms, 2m and the like, up to 1h", shown(text)));
  }
  return std::chrono::duration_cast<Duration>(std::chrono::duration<double>(seconds));
}

void add_record_trace(const Command& plcctl, CliSession& session) {
  const auto arguments = std::make_shared<TraceArguments>();
  plcctl.verb("record", "Write samples of variables, or what tasks do, into a file")
      .noun("trace", "Each cycle and post of the tasks of one or more instances, for ui.perfetto.dev",
            [&session, arguments] { return record(session, *arguments); })
      .arguments(
          "INSTANCE", arguments->names,
          "one or more, of all hosts that --host and --label select; 'line*' stands for all that begin "
          "with line, 'all' for all")
      .option("-d,--duration", arguments->duration,
              "5s, 500ms, 2m; without it: until Ctrl-C, an hour at most")
      .file("-o,--file", arguments->file, "the file; only its owner may read it");
}

}  // namespace plchost
