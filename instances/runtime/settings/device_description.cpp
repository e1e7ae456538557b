#include "instances/runtime/settings/device_description.hpp"

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <iterator>

#include <fmt/format.h>
#include <pugixml.hpp>

#include "shm/base/names.hpp"
#include "shm/base/trimmed.hpp"

namespace plchost {

namespace {

using pugi::xml_node;

// pugixml expands no entities of a document and reads no other files; parsing keeps no stack.
constexpr unsigned kParse = pugi::parse_default | pugi::parse_ws_pcdata_single;

/// Where in the file something stands.
class Place {
 public:
  Place(std::string_view text, std::string_view file) : text_(text), file_(file) {}

  [[nodiscard]] std::unexpected<Error> wrong(std::ptrdiff_t offset, std::string_view what) const {
    const auto end = static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(offset, 0, std::ssize(text_)));
    const auto line = 1 + std::ranges::count(text_.substr(0, end), '\n');
    return failure(ErrorCode::invalid_argument, fmt::format("{}:{}: {}", file_, line, what));
  }

 private:
  std::string_view text_;
  std::string_view file_;
};

// "ts:section" is a section whatever prefix the file gives the name space.
std::string_view local_name(const xml_node& node) {
  const std::string_view name = node.name();
  return name.substr(name.find(':') + 1);  // npos + 1: all of it
}

xml_node child_called(const xml_node& parent, std::string_view name, std::string_view with_name = {}) {
  for (const xml_node child : parent.children()) {
    if (local_name(child) != name) continue;
    if (with_name.empty() || child.attribute("name").value() == with_name) return child;
  }
  return {};
}

constexpr std::string_view kXmlBlanks = " \t\r\n";

// All texts and CDATA sections of it: an editor may have split them.
std::string text_in(const xml_node& node) {
  std::string text;
  for (const xml_node child : node.children()) {
    if (child.type() == pugi::node_pcdata || child.type() == pugi::node_cdata) text += child.value();
  }
  return text;
}

Result<std::vector<std::string>> events_below(const xml_node& events, const Place& place,
                                              std::ptrdiff_t offset) {
  std::vector<std::string> names;
  for (const xml_node event : events.children()) {
    if (event.type() != pugi::node_element) continue;
    if (local_name(event) != "externalevent") {
      return place.wrong(offset, fmt::format("externalevents: '{}' is not allowed: externalevent is",
                                             shown(local_name(event))));
    }
    const xml_node name = child_called(event, "name");
    if (!name) return place.wrong(offset, "externalevents: an externalevent without a name");
    const std::string text(trimmed(text_in(name), kXmlBlanks));
    if (auto valid = check_name("externalevents: name", text, kMaxEventName); !valid) {
      return place.wrong(offset, valid.error().message);
    }
    if (std::ranges::find(names, text) != names.end()) {
      return place.wrong(offset, fmt::format("externalevents: '{}' is there twice", text));
    }
    if (names.size() == kMaxDeviceEvents) {
      return place.wrong(offset, fmt::format("externalevents: more than {} events", kMaxDeviceEvents));
    }
    names.push_back(text);
  }
  return names;
}

// The value is XML in a text (type "cdata"), or the elements themselves.
Result<std::vector<std::string>> events_of(const xml_node& value, const Place& place) {
  const std::ptrdiff_t offset = value.offset_debug();
  if (const xml_node events = child_called(value, "externalevents"))
    return events_below(events, place, offset);
  for (const xml_node other : value.children()) {
    if (other.type() != pugi::node_element) continue;
    return place.wrong(offset,
                       fmt::format("externalevents: '{}' is not allowed in its value: externalevents is",
                                   shown(local_name(other))));
  }
  const std::string inner = text_in(value);
  if (trimmed(inner, kXmlBlanks).empty()) return std::vector<std::string>();
  pugi::xml_document document;
  const auto parsed = document.load_buffer(inner.data(), inner.size(), kParse, pugi::encoding_utf8);
  if (!parsed) {
    return place.wrong(offset, fmt::format("externalevents: its value is no XML: {}", parsed.description()));
  }
  const xml_node events = child_called(document, "externalevents");
  if (!events) return place.wrong(offset, "externalevents: its value has no <externalevents>");
  return events_below(events, place, offset);
}

Result<bool> supports_external(const xml_node& setting, const Place& place) {
  if (!setting) return false;
  const std::string text = text_in(child_called(setting, "value"));
  const std::string_view value = trimmed(text, kXmlBlanks);
  if (value == "1" || value == "0") return value == "1";
  return place.wrong(setting.offset_debug(),
                     fmt::format("supportexternal: '{}' is not allowed: 0 and 1 are", shown(value)));
}

}  // namespace

Result<DeviceDescription> parse_device_description(std::string_view text, std::string_view file) {
  const Place place(text, file);
  if (text.size() > kMaxDeviceDescription) {
    return place.wrong(
        0, fmt::format("{} bytes are too many: {} are allowed", text.size(), kMaxDeviceDescription));
  }
  pugi::xml_document document;
  const auto parsed = document.load_buffer(text.data(), text.size(), kParse);
  if (!parsed) return place.wrong(parsed.offset, fmt::format("no XML: {}", parsed.description()));
  xml_node at = child_called(document, "DeviceDescription");
  if (!at) return place.wrong(0, "no device description: its root is not <DeviceDescription>");
  for (const std::string_view name : {"Device", "ExtendedSettings", "TargetSettings"})
    at = child_called(at, name);
  const xml_node section = child_called(at, "section", "taskconfiguration");
  PLCHOST_TRY_ASSIGN(const auto supported,
                     supports_external(child_called(section, "setting", "supportexternal"), place));
  DeviceDescription device{.supports_external = supported, .events = {}};
  const xml_node setting = child_called(section, "setting", "externalevents");
  if (!device.supports_external || !setting) return device;
  PLCHOST_TRY_ASSIGN(device.events, events_of(child_called(setting, "value"), place));
  return device;
}

Result<DeviceDescription> read_device_description(const std::string& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) {
    const int error = errno;
    return failure(error == ENOENT ? ErrorCode::not_found : ErrorCode::system, "device description " + file,
                   error);
  }
  std::string text;
  text.resize(kMaxDeviceDescription + 1);
  stream.read(text.data(), std::ssize(text));
  if (stream.bad()) return failure(ErrorCode::system, "cannot read device description " + file, errno);
  text.resize(static_cast<std::size_t>(stream.gcount()));
  return parse_device_description(text, file);
}

}  // namespace plchost
