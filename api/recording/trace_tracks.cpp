#include "api/recording/trace_tracks.hpp"

#include <algorithm>
#include <array>
#include <string_view>
#include <unordered_map>
#include <utility>

#include <fmt/format.h>

#include "api/recording/nested_spans.hpp"
#include "api/recording/task_activity.hpp"
#include "shm/base/fault_record.hpp"
#include "shm/base/names.hpp"
#include "shm/pages/flight_page.hpp"

namespace plchost {

namespace {

/// A post of an event, as entries name it: the mark of the event, and the lower half of its count.
constexpr std::uint64_t key_of_post(std::uint32_t mark, std::uint32_t count) noexcept {
  return std::uint64_t{mark & kEventMarkMask} << 32 | count;
}
constexpr std::uint64_t key_of_post(const FlightEntry& posted) noexcept {
  return static_cast<std::uint64_t>(posted.figure) & key_of_post(kEventMarkMask, UINT32_MAX);
}
constexpr std::uint32_t mark_of(std::uint64_t key) noexcept {
  return static_cast<std::uint32_t>(key >> 32);
}
constexpr std::uint32_t count_of(std::uint64_t key) noexcept {
  return static_cast<std::uint32_t>(key);
}

struct TracedTask {
  const RecordedRing* ring;
  TaskActivity activity;
  std::uint64_t track = 0;
};

struct TracedInstance {
  const FlightRecording* recording;
  std::vector<TracedTask> tasks;
  std::uint64_t track = 0;
};

/// A post that was seen at one of its two ends, or both.
struct TracedPost {
  std::optional<std::int64_t> posted;
  std::optional<std::int64_t> taken;
  std::string by;

  // A task of higher priority may have begun its cycle before the poster could write that it has posted.
  [[nodiscard]] std::int64_t time() const {
    if (posted && taken) return std::min(*posted, *taken);
    return posted ? *posted : taken.value_or(0);
  }
};

/// Writes the tracks of one host.
class HostTracks {
 public:
  HostTracks(PerfettoTrace& trace, const HostRecording& host, std::uint32_t number, std::int64_t boot_ns,
             std::uint64_t& next_id, TraceCounts& counts)
      : trace_(trace), host_(host), number_(number), boot_(boot_ns), next_id_(next_id), counts_(counts) {}

  void write() {
    read();
    const std::uint64_t process = next_id_++;
    trace_.add({.id = process,
                .parent = 0,
                .name = host_.host,
                .rank = 0,
                .host = static_cast<std::int32_t>(number_)});
    tell_clock(process);
    std::int32_t rank = 0;
    write_cores(process, rank);
    write_events(process, rank);
    for (TracedInstance& instance : instances_) write_instance(instance, process, rank++);
  }

 private:
  [[nodiscard]] std::uint64_t at(std::int64_t host_ns) const {
    return static_cast<std::uint64_t>(std::max<std::int64_t>(host_.time.here(host_ns) + boot_, 0));
  }
  std::uint64_t add_track(std::uint64_t parent, std::string name, std::int32_t rank) {
    const std::uint64_t id = next_id_++;
    trace_.add({.id = id, .parent = parent, .name = std::move(name), .rank = rank, .host = std::nullopt});
    return id;
  }
  [[nodiscard]] std::string event_name(std::uint32_t mark) const {
    const auto known = host_.events.find(mark);
    return known != host_.events.end() ? known->second : fmt::format("{:#08x}", mark);
  }
  // Of the posts of one host none have the same number, and none of another host.
  [[nodiscard]] std::uint64_t flow_of(std::uint64_t key) const noexcept {
    constexpr unsigned kHostBits = 9;
    return key | std::uint64_t{number_ & ((1U << kHostBits) - 1)} << (64 - kHostBits);
  }

  void read() {
    for (const FlightRecording& recording : host_.instances) {
      TracedInstance& instance = instances_.emplace_back(TracedInstance{&recording, {}});
      counts_.missing += recording.missing();
      counts_.damaged += recording.damaged();
      const auto faults = faults_of(recording);
      for (const RecordedRing& ring : recording.rings()) {
        if (ring.task.empty()) continue;
        instance.tasks.push_back(
            {&ring, activity_of(ring, recording.begin_ns(), recording.end_ns(), faults)});
        find_posts(recording, instance.tasks.back());
      }
      std::ranges::stable_sort(instance.tasks, {},
                               [](const TracedTask& task) { return task.ring->iec_priority; });
    }
    for (const auto& [key, post] : posts_) {
      if (post.posted && post.taken) ++counts_.flows;
    }
  }

  static std::vector<RecordedFault> faults_of(const FlightRecording& recording) {
    std::vector<RecordedFault> faults;
    for (const RecordedRing& ring : recording.rings()) {
      for (const FlightEntry& entry : ring.entries) {
        const std::int64_t task = entry.figure >> 8;
        if (entry.kind == FlightKind::fault && task >= 0 && task < kMaxTasksOfARecorder)
          faults.push_back(
              {static_cast<std::uint32_t>(kFirstTaskRing + static_cast<std::size_t>(task)), entry.time_ns});
      }
    }
    return faults;
  }

  void find_posts(const FlightRecording& recording, const TracedTask& task) {
    for (const FlightEntry& entry : task.activity.moments) {
      if (entry.kind != FlightKind::posted) continue;
      TracedPost& post = posts_[key_of_post(entry)];
      post.posted = std::min(post.posted.value_or(entry.time_ns), entry.time_ns);
      post.by = fmt::format("{}/{}", recording.instance(), task.ring->task);
    }
    for (const RecordedCycle& cycle : task.activity.cycles) {
      if (!cycle.post || task.ring->event_mark == 0) continue;
      TracedPost& post = posts_[key_of_post(task.ring->event_mark, *cycle.post)];
      const std::int64_t waited = std::clamp<std::int64_t>(cycle.latency_ns, 0, cycle.from);
      const std::int64_t released = std::max(cycle.from - waited, recording.begin_ns());
      post.taken = std::min(post.taken.value_or(released), released);
    }
  }

  void tell_clock(std::uint64_t process) const {
    constexpr double kPpb = 1e9;
    if (host_.instances.empty()) return;
    const auto first = std::ranges::min_element(host_.instances, {}, &FlightRecording::begin_ns);
    trace_.instant(process, at(first->begin_ns()), "clock of the host",
                   {{"ahead_ns", host_.time.offset_ns},
                    {"uncertainty_ns", host_.time.uncertainty_ns},
                    {"drift_ppb", static_cast<std::int64_t>(host_.time.drift * kPpb)}});
  }

  void write_cores(std::uint64_t process, std::int32_t& rank) {
    std::map<std::int32_t, std::vector<TimeSpan>> cores;
    std::vector<std::string> names;
    for (const TracedInstance& instance : instances_) {
      if (instance.recording->core() < 0) continue;
      auto& spans = cores[instance.recording->core()];
      for (const TracedTask& task : instance.tasks) {
        add_spans(spans, task.activity, names.size());
        names.push_back(fmt::format("{}/{}", instance.recording->instance(), task.ring->task));
      }
    }
    for (const auto& [core, spans] : cores) {
      const std::uint64_t track = add_track(process, fmt::format("core {}", core), rank++);
      for (const NestedStep& step : nested(spans)) {
        if (!step.begins) {
          trace_.end(track, at(step.time));
          continue;
        }
        const auto notes = step.again ? TraceNotes{{"continued", std::int64_t{1}}} : TraceNotes{};
        trace_.begin(track, at(step.time), names[spans[step.span].who], notes);
      }
    }
  }

  // A task that a debugger halts does not have the core.
  static void add_spans(std::vector<TimeSpan>& spans, const TaskActivity& activity, std::size_t who) {
    auto halt = activity.halts.begin();
    for (const RecordedCycle& cycle : activity.cycles) {
      std::int64_t from = cycle.from;
      for (; halt != activity.halts.end() && halt->to <= cycle.to; ++halt) {
        if (halt->from < from) continue;
        spans.push_back({from, halt->from, who});
        from = halt->to;
      }
      spans.push_back({from, cycle.to, who});
    }
  }

  void write_events(std::uint64_t process, std::int32_t& rank) {
    std::vector<std::uint64_t> keys;
    for (const auto& [key, post] : posts_) keys.push_back(key);
    std::ranges::sort(keys, {},
                      [&](std::uint64_t key) { return std::pair(mark_of(key), posts_[key].time()); });
    std::uint64_t track = 0;
    std::optional<std::uint32_t> mark;
    for (const std::uint64_t key : keys) {
      if (mark != mark_of(key)) {
        mark = mark_of(key);
        track = add_track(process, fmt::format("event {}", event_name(*mark)), rank++);
      }
      const TracedPost& post = posts_[key];
      trace_.instant(track, at(post.time()), fmt::format("post {}", count_of(key)),
                     {{"by", post.by.empty() ? "no task" : post.by}}, std::array{flow_of(key)});
    }
  }

  void write_instance(TracedInstance& instance, std::uint64_t process, std::int32_t rank) {
    instance.track = add_track(process, instance.recording->instance(), rank);
    std::int32_t place = 0;
    for (TracedTask& task : instance.tasks) {
      task.track = add_track(instance.track, task.ring->task, place++);
      write_task(task);
    }
    static constexpr std::array kNames{"runtime", "supervision", "event variables"};
    for (const RecordedRing& ring : instance.recording->rings()) {
      if (ring.ring >= kNames.size() || !ring.task.empty() || ring.entries.empty()) continue;
      write_ring(instance, ring, add_track(instance.track, kNames[ring.ring], place++));
    }
  }

  void write_task(const TracedTask& task) {
    const TaskActivity& activity = task.activity;
    counts_.cycles += activity.cycles.size();
    // Events of one time stay in their order: the end of one before the begin of the next.
    auto halt = activity.halts.begin();
    auto work = activity.work.begin();
    for (const RecordedCycle& cycle : activity.cycles) {
      for (; work != activity.work.end() && work->to <= cycle.from; ++work) write_piece(task.track, *work);
      begin_cycle(task, cycle);
      for (; halt != activity.halts.end() && halt->to <= cycle.to; ++halt) write_piece(task.track, *halt);
      TraceNotes notes;
      if (cycle.spun_ns != 0) notes.push_back({"spun_ahead_ns", cycle.spun_ns});
      if (cycle.cut != CycleCut::none) notes.push_back({"not_whole", std::string(to_string(cycle.cut))});
      trace_.end(task.track, at(cycle.to), notes);
    }
    for (; work != activity.work.end(); ++work) write_piece(task.track, *work);
    for (const FlightEntry& entry : activity.moments) write_moment(task, entry);
    for (const TaskActivity::Missing& missing : activity.missing) write_missing(task.track, missing);
  }

  void begin_cycle(const TracedTask& task, const RecordedCycle& cycle) {
    TraceNotes notes;
    if (cycle.cut != CycleCut::began_earlier) notes.push_back({"latency_ns", cycle.latency_ns});
    if (cycle.lost != 0) notes.push_back({"lost_releases", cycle.lost});
    std::vector<std::uint64_t> flows;
    if (cycle.post) {
      notes.push_back({"post", std::int64_t{*cycle.post}});
      const std::uint32_t mark = task.ring->event_mark;
      if (mark != 0) {
        notes.push_back({"event", event_name(mark)});
        flows.push_back(flow_of(key_of_post(mark, *cycle.post)));
      }
    }
    trace_.begin(task.track, at(cycle.from), "cycle", notes, flows);
  }

  void write_piece(std::uint64_t track, const TaskActivity::Piece& piece) {
    trace_.begin(track, at(piece.from), to_string(piece.kind));
    trace_.end(track, at(piece.to));
  }

  void write_missing(std::uint64_t track, const TaskActivity::Missing& missing) {
    trace_.instant(track, at(missing.time_ns), "entries are missing",
                   {{"count", static_cast<std::int64_t>(std::min<std::uint64_t>(missing.count, INT64_MAX))}});
  }

  void write_moment(const TracedTask& task, const FlightEntry& entry) {
    if (entry.kind == FlightKind::posted) {
      const std::uint64_t key = key_of_post(entry);
      const std::string event = event_name(mark_of(key));
      trace_.instant(task.track, at(posts_[key].time()), "posted " + event,
                     {{"event", event}, {"post", std::int64_t{count_of(key)}}}, std::array{flow_of(key)});
      return;
    }
    const char* const figure = entry.kind == FlightKind::lost    ? "releases"
                               : entry.kind == FlightKind::moved ? "by_ns"
                                                                 : "figure";
    trace_.instant(task.track, at(entry.time_ns), word_of(entry.kind), {{figure, entry.figure}});
  }

  static std::string word_of(FlightKind kind) {
    const std::string_view word = to_string(kind);
    return word == "unknown" ? fmt::format("kind {}", std::to_underlying(kind)) : std::string(word);
  }

  // The threads beside the tasks tell of what has ended, and how long it took.
  void write_ring(const TracedInstance& instance, const RecordedRing& ring, std::uint64_t track) {
    std::int64_t free_since = instance.recording->begin_ns();
    auto gap = ring.gaps.begin();
    for (std::size_t i = 0; i < ring.entries.size(); ++i) {
      const FlightEntry& entry = ring.entries[i];
      for (; gap != ring.gaps.end() && gap->before == i; ++gap) {
        if (gap->missing > 0) write_missing(track, {entry.time_ns, gap->missing});
        if (gap->process > 0)
          trace_.instant(track, at(entry.time_ns), "new process", {{"pid", std::int64_t{gap->process}}});
      }
      write_entry(instance, track, entry, free_since);
    }
  }

  void write_entry(const TracedInstance& instance, std::uint64_t track, const FlightEntry& entry,
                   std::int64_t& free_since) {
    const bool has_length = entry.kind == FlightKind::switched || entry.kind == FlightKind::held ||
                            entry.kind == FlightKind::late || entry.kind == FlightKind::polled;
    if (has_length && entry.figure > 0 && entry.time_ns > free_since) {
      const std::int64_t most = entry.time_ns - free_since;
      write_piece(track, {entry.time_ns - std::min(entry.figure, most), entry.time_ns, entry.kind});
      free_since = entry.time_ns;
      return;
    }
    TraceNotes notes;
    if (entry.kind == FlightKind::fault || entry.kind == FlightKind::struck) {
      notes.push_back({"task", task_of(instance, entry.figure >> 8)});
      notes.push_back({"fault", std::string(to_string(static_cast<FaultKind>(entry.figure & 0xff)))});
    } else if (entry.figure != 0) {
      notes.push_back({"figure", entry.figure});
    }
    trace_.instant(track, at(entry.time_ns), word_of(entry.kind), notes);
  }

  static std::string task_of(const TracedInstance& instance, std::int64_t number) {
    for (const TracedTask& task : instance.tasks) {
      if (std::int64_t{task.ring->ring} - std::int64_t{kFirstTaskRing} == number) return task.ring->task;
    }
    return fmt::format("task {}", number);
  }

  static constexpr std::int64_t kMaxTasksOfARecorder = dds::bounds::TracePage::rings - kFirstTaskRing;

  PerfettoTrace& trace_;
  const HostRecording& host_;
  std::uint32_t number_;
  std::int64_t boot_;
  std::uint64_t& next_id_;
  TraceCounts& counts_;
  std::vector<TracedInstance> instances_;
  std::unordered_map<std::uint64_t, TracedPost> posts_;
};

}  // namespace

TraceCounts write_tracks(PerfettoTrace& trace, std::span<const HostRecording> hosts,
                         const TraceClocks& clocks) {
  trace.tell(clocks);
  TraceCounts counts;
  std::uint64_t next_id = 1;
  std::uint32_t number = 1;
  const auto boot = static_cast<std::int64_t>(clocks.boot_ns - clocks.monotonic_ns);
  for (const HostRecording& host : hosts) HostTracks(trace, host, number++, boot, next_id, counts).write();
  return counts;
}

}  // namespace plchost
