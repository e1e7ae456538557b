#pragma once

#include <cstdint>
#include <functional>
#include <initializer_list>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "api/recording/protobuf_message.hpp"

namespace plchost {

/// A named value beside an event: an argument in Perfetto.
struct TraceNote {
  std::string_view name;
  std::variant<std::int64_t, std::string> value;
};
using TraceNotes = std::vector<TraceNote>;

/// A line of the trace on which events stand.
struct TraceTrack {
  std::uint64_t id = 0;      ///< not 0; of one track only
  std::uint64_t parent = 0;  ///< 0: none
  std::string name;
  std::int32_t rank = 0;             ///< its place below its parent
  std::optional<std::int32_t> host;  ///< a number from 1 on: the track is a process in Perfetto
};

/// One moment by several clocks.
struct TraceClocks {
  std::uint64_t boot_ns = 0;
  std::uint64_t monotonic_ns = 0;
  std::uint64_t unix_ns = 0;
};

/// Writes a trace of Perfetto (perfetto.dev), packet after packet. Times are of CLOCK_BOOTTIME, which
/// Perfetto takes for granted. Packets may come in any order of time; those of one track and time stay in
/// theirs. On a track each end belongs to the last begin that has none.
class PerfettoTrace {
 public:
  /// Takes the bytes of one packet after the other.
  using Sink = std::function<void(std::string_view)>;

  explicit PerfettoTrace(Sink sink) : sink_(std::move(sink)) {}

  /// First: how the clocks of this machine belong together.
  void tell(const TraceClocks& clocks);
  void add(const TraceTrack& track);
  /// `flows`: arrows through all events with the same number.
  void begin(std::uint64_t track, std::uint64_t time_ns, std::string_view name, const TraceNotes& notes = {},
             std::span<const std::uint64_t> flows = {});
  void end(std::uint64_t track, std::uint64_t time_ns, const TraceNotes& notes = {});
  void instant(std::uint64_t track, std::uint64_t time_ns, std::string_view name,
               const TraceNotes& notes = {}, std::span<const std::uint64_t> flows = {});

 private:
  enum class EventType : std::uint8_t { begin = 1, end = 2, instant = 3 };
  void event(EventType type, std::uint64_t track, std::uint64_t time_ns, std::string_view name,
             const TraceNotes& notes, std::span<const std::uint64_t> flows);
  void put(ProtobufMessage& packet);

  Sink sink_;
  bool first_ = true;
};

}  // namespace plchost
