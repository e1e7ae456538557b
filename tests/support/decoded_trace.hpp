#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace plchost {

/// A trace as protoc of Debian reads it: an independent decoder of the bytes.
struct DecodedTrace {
  struct Event {
    enum class Type : std::uint8_t { begin, end, instant };
    Type type = Type::instant;
    std::uint64_t time = 0;
    std::uint64_t track = 0;
    std::string name;
    std::map<std::string, std::string> notes;
    std::vector<std::uint64_t> flows;
  };
  struct Track {
    std::uint64_t id = 0;
    std::uint64_t parent = 0;
    std::string name;
    std::optional<int> pid;
  };
  std::string text;
  std::string errors;  ///< of protoc, and of events: a slice without a begin or an end, or without a track
  std::map<std::uint64_t, std::uint64_t> clocks;
  std::vector<Track> tracks;
  std::vector<Event> events;  ///< by time; those of one time as in the file

  /// "host/line1/Fill"
  [[nodiscard]] std::string path(std::uint64_t track) const;
  [[nodiscard]] std::vector<Event> on(std::string_view path) const;
};

[[nodiscard]] DecodedTrace decode(std::string_view bytes);

/// The events as "begin 5 cycle", "end 7", for comparison.
[[nodiscard]] std::vector<std::string> lines_of(const std::vector<DecodedTrace::Event>& events);

}  // namespace plchost
