#include "api/recording/perfetto_trace.hpp"

#include <utility>

namespace plchost {

namespace {

// Numbers of fields, from Perfetto's protos/perfetto/trace: trace.proto, trace_packet.proto,
// clock_snapshot.proto, and those of track_event.
namespace trace {
constexpr std::uint32_t kPacket = 1;
}
namespace packet {
constexpr std::uint32_t kClockSnapshot = 6;
constexpr std::uint32_t kTimestamp = 8;
constexpr std::uint32_t kSequenceId = 10;
constexpr std::uint32_t kTrackEvent = 11;
constexpr std::uint32_t kSequenceFlags = 13;
constexpr std::uint32_t kTrackDescriptor = 60;
constexpr std::uint32_t kFirstOnSequence = 87;
}  // namespace packet
namespace snapshot {
constexpr std::uint32_t kClocks = 1;
constexpr std::uint32_t kClockId = 1;
constexpr std::uint32_t kTimestamp = 2;
}  // namespace snapshot
namespace track_descriptor {
constexpr std::uint32_t kUuid = 1;
constexpr std::uint32_t kName = 2;
constexpr std::uint32_t kProcess = 3;
constexpr std::uint32_t kParentUuid = 5;
constexpr std::uint32_t kChildOrdering = 11;
constexpr std::uint32_t kRank = 12;
constexpr std::uint32_t kPid = 1;
constexpr std::uint32_t kProcessName = 6;
}  // namespace track_descriptor
namespace track_event {
constexpr std::uint32_t kDebugAnnotations = 4;
constexpr std::uint32_t kType = 9;
constexpr std::uint32_t kTrackUuid = 11;
constexpr std::uint32_t kName = 23;
constexpr std::uint32_t kFlowIds = 47;
constexpr std::uint32_t kNoteInt = 4;
constexpr std::uint32_t kNoteText = 6;
constexpr std::uint32_t kNoteName = 10;
}  // namespace track_event

constexpr std::uint64_t kRealtime = 1;
constexpr std::uint64_t kMonotonic = 3;
constexpr std::uint64_t kBoottime = 6;
constexpr std::uint64_t kByRank = 3;    // TrackDescriptor.ChildTracksOrdering.EXPLICIT
constexpr std::uint64_t kSequence = 1;  // any but 0: all packets are of one writer
constexpr std::uint64_t kStateCleared = 1;

ProtobufMessage clock(std::uint64_t id, std::uint64_t time_ns) {
  ProtobufMessage clock;
  clock.add(snapshot::kClockId, id);
  clock.add(snapshot::kTimestamp, time_ns);
  return clock;
}

ProtobufMessage message_of(const TraceNote& note) {
  ProtobufMessage message;
  message.add(track_event::kNoteName, note.name);
  if (const auto* const number = std::get_if<std::int64_t>(&note.value)) {
    message.add(track_event::kNoteInt, static_cast<std::uint64_t>(*number));
  } else {
    message.add(track_event::kNoteText, std::string_view(std::get<std::string>(note.value)));
  }
  return message;
}

}  // namespace

void PerfettoTrace::put(ProtobufMessage& packet) {
  packet.add(packet::kSequenceId, kSequence);
  if (std::exchange(first_, false)) {
    packet.add(packet::kSequenceFlags, kStateCleared);
    packet.add(packet::kFirstOnSequence, std::uint64_t{1});
  }
  ProtobufMessage part;  // a trace may be put together of its parts
  part.add(trace::kPacket, packet);
  sink_(part.bytes());
}

void PerfettoTrace::tell(const TraceClocks& clocks) {
  ProtobufMessage all;
  all.add(snapshot::kClocks, clock(kBoottime, clocks.boot_ns));
  all.add(snapshot::kClocks, clock(kMonotonic, clocks.monotonic_ns));
  all.add(snapshot::kClocks, clock(kRealtime, clocks.unix_ns));
  ProtobufMessage packet;
  packet.add(packet::kTimestamp, clocks.boot_ns);
  packet.add(packet::kClockSnapshot, all);
  put(packet);
}

void PerfettoTrace::add(const TraceTrack& track) {
  ProtobufMessage told;
  told.add(track_descriptor::kUuid, track.id);
  if (track.parent != 0) {
    told.add(track_descriptor::kParentUuid, track.parent);
    told.add(track_descriptor::kRank, static_cast<std::uint64_t>(std::int64_t{track.rank}));
  }
  if (track.host) {
    ProtobufMessage process;
    process.add(track_descriptor::kPid, static_cast<std::uint64_t>(std::int64_t{*track.host}));
    process.add(track_descriptor::kProcessName, std::string_view(track.name));
    told.add(track_descriptor::kProcess, process);
  } else {
    told.add(track_descriptor::kName, std::string_view(track.name));
  }
  told.add(track_descriptor::kChildOrdering, kByRank);
  ProtobufMessage packet;
  packet.add(packet::kTrackDescriptor, told);
  put(packet);
}

void PerfettoTrace::begin(std::uint64_t track, std::uint64_t time_ns, std::string_view name,
                          const TraceNotes& notes, std::span<const std::uint64_t> flows) {
  event(EventType::begin, track, time_ns, name, notes, flows);
}

void PerfettoTrace::end(std::uint64_t track, std::uint64_t time_ns, const TraceNotes& notes) {
  event(EventType::end, track, time_ns, {}, notes, {});
}

void PerfettoTrace::instant(std::uint64_t track, std::uint64_t time_ns, std::string_view name,
                            const TraceNotes& notes, std::span<const std::uint64_t> flows) {
  event(EventType::instant, track, time_ns, name, notes, flows);
}

void PerfettoTrace::event(EventType type, std::uint64_t track, std::uint64_t time_ns, std::string_view name,
                          const TraceNotes& notes, std::span<const std::uint64_t> flows) {
  ProtobufMessage told;
  for (const TraceNote& note : notes) told.add(track_event::kDebugAnnotations, message_of(note));
  told.add(track_event::kType, std::uint64_t{std::to_underlying(type)});
  told.add(track_event::kTrackUuid, track);
  if (!name.empty()) told.add(track_event::kName, name);
  for (const std::uint64_t flow : flows) told.add_fixed(track_event::kFlowIds, flow);
  ProtobufMessage packet;
  packet.add(packet::kTimestamp, time_ns);
  packet.add(packet::kTrackEvent, told);
  put(packet);
}

}  // namespace plchost
