#include "tests/support/decoded_trace.hpp"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <sstream>

#include <fmt/format.h>
#include <unistd.h>

namespace plchost {

namespace {

using Event = DecodedTrace::Event;

/// A message in protoc's text: one field or bracket a line.
struct TextNode {
  std::multimap<std::string, std::string> values;
  std::multimap<std::string, TextNode> parts;

  [[nodiscard]] std::string value(const std::string& name) const {
    const auto found = values.find(name);
    return found == values.end() ? "" : found->second;
  }
  [[nodiscard]] std::uint64_t number(const std::string& name) const {
    return std::strtoull(value(name).c_str(), nullptr, 10);
  }
};

TextNode read_node(std::istream& lines) {
  TextNode node;
  for (std::string line; std::getline(lines, line);) {
    line.erase(0, line.find_first_not_of(' '));
    if (line == "}") break;
    if (line.ends_with(" {")) {
      node.parts.emplace(line.substr(0, line.size() - 2), read_node(lines));
      continue;
    }
    const auto colon = line.find(": ");
    std::string value = line.substr(colon + 2);
    if (value.starts_with('"')) value = value.substr(1, value.size() - 2);
    node.values.emplace(line.substr(0, colon), value);
  }
  return node;
}

std::string text_by_protoc(std::string_view bytes, std::string& errors) {
  std::string file = "/tmp/plchost-trace-XXXXXX";
  const int fd = ::mkstemp(file.data());
  ::close(fd);
  std::ofstream(file, std::ios::binary) << bytes;
  const std::string command = fmt::format(
      "protoc --proto_path={0} --decode=Trace {0}/perfetto_trace.proto <{1} 2>&1", TESTS_SUPPORT, file);
  std::FILE* const pipe = ::popen(command.c_str(), "r");
  std::string text;
  for (int c = std::fgetc(pipe); c != EOF; c = std::fgetc(pipe)) text.push_back(static_cast<char>(c));
  if (const int code = ::pclose(pipe); code != 0) errors += fmt::format("protoc: {} {}\n", code, text);
  ::unlink(file.c_str());
  return text;
}

Event event_of(const TextNode& packet, const TextNode& told) {
  Event event;
  event.time = packet.number("timestamp");
  event.track = told.number("track_uuid");
  event.name = told.value("name");
  const std::string type = told.value("type");
  event.type = type == "TYPE_SLICE_BEGIN" ? Event::Type::begin
               : type == "TYPE_SLICE_END" ? Event::Type::end
                                          : Event::Type::instant;
  const auto [note, notes_end] = told.parts.equal_range("debug_annotations");
  for (auto i = note; i != notes_end; ++i) {
    const bool is_text = i->second.values.contains("string_value");
    event.notes[i->second.value("name")] = i->second.value(is_text ? "string_value" : "int_value");
  }
  const auto [flow, flows_end] = told.values.equal_range("flow_ids");
  for (auto i = flow; i != flows_end; ++i)
    event.flows.push_back(std::strtoull(i->second.c_str(), nullptr, 10));
  return event;
}

DecodedTrace::Track track_of(const TextNode& told) {
  DecodedTrace::Track track;
  track.id = told.number("uuid");
  track.parent = told.number("parent_uuid");
  track.name = told.value("name");
  if (const auto process = told.parts.find("process"); process != told.parts.end()) {
    track.name = process->second.value("process_name");
    track.pid = static_cast<int>(process->second.number("pid"));
  }
  return track;
}

void check_slices(DecodedTrace& trace) {
  std::map<std::uint64_t, int> open;
  for (const Event& event : trace.events) {
    const auto known = std::ranges::find(trace.tracks, event.track, &DecodedTrace::Track::id);
    if (known == trace.tracks.end()) trace.errors += fmt::format("no track {}\n", event.track);
    if (event.type == Event::Type::begin) ++open[event.track];
    if (event.type == Event::Type::end && --open[event.track] < 0)
      trace.errors += fmt::format("an end without a begin on {}\n", trace.path(event.track));
  }
  for (const auto& [track, count] : open)
    if (count > 0) trace.errors += fmt::format("a begin without an end on {}\n", trace.path(track));
}

}  // namespace

std::string DecodedTrace::path(std::uint64_t track) const {
  const auto known = std::ranges::find(tracks, track, &Track::id);
  if (known == tracks.end()) return "?";
  return known->parent == 0 ? known->name : path(known->parent) + "/" + known->name;
}

std::vector<Event> DecodedTrace::on(std::string_view wanted) const {
  std::vector<Event> found;
  std::ranges::copy_if(events, std::back_inserter(found),
                       [&](const Event& event) { return path(event.track) == wanted; });
  return found;
}

DecodedTrace decode(std::string_view bytes) {
  DecodedTrace trace;
  trace.text = text_by_protoc(bytes, trace.errors);
  if (!trace.errors.empty()) return trace;
  std::istringstream lines(trace.text);
  const TextNode root = read_node(lines);
  for (const auto& [word, packet] : root.parts) {
    for (const auto& [part, told] : packet.parts) {
      if (part == "track_event") trace.events.push_back(event_of(packet, told));
      if (part == "track_descriptor") trace.tracks.push_back(track_of(told));
      if (part != "clock_snapshot") continue;
      for (const auto& [name, clock] : told.parts)
        trace.clocks[clock.number("clock_id")] = clock.number("timestamp");
    }
  }
  std::ranges::stable_sort(trace.events, {}, &Event::time);
  check_slices(trace);
  return trace;
}

std::vector<std::string> lines_of(const std::vector<Event>& events) {
  std::vector<std::string> lines;
  for (const Event& event : events) {
    const char* const type = event.type == Event::Type::begin ? "begin"
                             : event.type == Event::Type::end ? "end"
                                                              : "instant";
    lines.push_back(fmt::format("{} {}{}{}", type, event.time, event.name.empty() ? "" : " ", event.name));
  }
  return lines;
}

}  // namespace plchost
