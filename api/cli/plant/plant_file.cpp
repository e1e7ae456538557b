#include "api/cli/plant/plant_file.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <iostream>
#include <iterator>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "shm/base/names.hpp"
#include "shm/toml/section_reader.hpp"
#include "shm/toml/toml_document.hpp"

namespace plchost {

namespace {

using namespace std::string_view_literals;

constexpr std::array kStates = {"running"sv, "stopped"sv};

class PlantReader {
 public:
  void read(const TomlTable& root);

  Plant plant;
  std::vector<ConfigProblem> problems;

 private:
  /// The tables of an array of tables; anything else is a problem. `form`: how it is written.
  [[nodiscard]] std::vector<const TomlValue*> tables(const TomlTable& parent, std::string_view key,
                                                     std::string_view form, std::size_t most);
  void read_host(const TomlValue& value);
  [[nodiscard]] WantedInstance read_instance(const TomlValue& value, const std::string& host);

  std::set<std::string, std::less<>> hosts_;
};

/// A text that can be a name; another type was told already.
void read_name(SectionReader& reader, std::string_view key, std::string& name, std::size_t most) {
  reader.text(key, name);
  if (!reader.has_text(key)) return;
  if (const auto good = check_name(key, name, most); !good) reader.problem(key, good.error().message);
}

/// How messages call a table; its name may be missing, or no text.
std::string title_of(const TomlTable& table, std::string_view form) {
  const auto name = table.find("name");
  const auto* text = name == table.end() ? nullptr : std::get_if<std::string>(&name->second.value);
  return text == nullptr ? std::string(form) : fmt::format("{} '{}'", form, shown(*text));
}

std::vector<const TomlValue*> PlantReader::tables(const TomlTable& parent, std::string_view key,
                                                  std::string_view form, std::size_t most) {
  const auto found = parent.find(key);
  if (found == parent.end()) return {};
  const auto* array = std::get_if<TomlArray>(&found->second.value);
  const auto is_table = [](const TomlValue& value) { return std::holds_alternative<TomlTable>(value.value); };
  if (array == nullptr || !std::ranges::all_of(*array, is_table)) {
    problems.push_back(
        {found->second.line, fmt::format("'{}' must be written with double brackets: {}", key, form)});
    return {};
  }
  if (array->size() > most) {
    problems.push_back(
        {found->second.line, fmt::format("{} times {}; allowed are up to {}", array->size(), form, most)});
    return {};
  }
  std::vector<const TomlValue*> found_tables;
  for (const TomlValue& value : *array) found_tables.push_back(&value);
  return found_tables;
}

void PlantReader::read(const TomlTable& root) {
  constexpr std::array kKnown = {"host"sv};
  for (const auto& [key, value] : root) {
    if (key == kKnown.front()) continue;
    problems.push_back({value.line, fmt::format("unknown section or key '{}'; allowed is [[host]]{}",
                                                shown(key), suggestion(key, kKnown))});
  }
  for (const TomlValue* host : tables(root, "host", "[[host]]", kMaxPlantHosts)) read_host(*host);
  if (plant.hosts.empty() && problems.empty()) problems.push_back({0, "describes no [[host]]"});
}

void PlantReader::read_host(const TomlValue& value) {
  const auto& table = std::get<TomlTable>(value.value);
  SectionReader reader(table, value.line, title_of(table, "[[host]]"), problems);
  WantedHost host{.name = "", .line = value.line, .instances = {}};
  read_name(reader, "name", host.name, kMaxHostName);
  if (!reader.has("name")) {
    reader.problem("name", "is missing");
  } else if (reader.has_text("name")) {
    if (!hosts_.insert(host.name).second)
      reader.problem("name", fmt::format("'{}' is there twice", shown(host.name)));
  }
  std::set<std::string> names;
  for (const TomlValue* element : tables(table, "instance", "[[host.instance]]", kMaxHostInstances)) {
    WantedInstance instance = read_instance(*element, host.name);
    if (!instance.name.empty() && !names.insert(instance.name).second) {
      problems.push_back({instance.line, fmt::format("[[host.instance]] '{}' of host '{}' is there twice",
                                                     shown(instance.name), shown(host.name))});
    }
    host.instances.push_back(std::move(instance));
  }
  reader.know("instance");
  reader.refuse_unknown_keys();
  plant.hosts.push_back(std::move(host));
}

WantedInstance PlantReader::read_instance(const TomlValue& value, const std::string& host) {
  const auto& table = std::get<TomlTable>(value.value);
  SectionReader reader(table, value.line,
                       title_of(table, fmt::format("[[host.instance]] of '{}'", shown(host))), problems);
  WantedInstance instance;
  instance.line = value.line;
  read_name(reader, "name", instance.name, kMaxInstanceName);
  read_name(reader, "scheduler", instance.scheduler, kMaxSchedulerName);
  reader.text("application", instance.application);
  std::string state;
  reader.choice("state", kStates, state);
  reader.texts("events", kMaxInstanceEvents, instance.events);
  reader.refuse_unknown_keys();
  if (!reader.has("name")) reader.problem("name", "is missing");
  if (reader.has_text("application") &&
      (!instance.application.starts_with('/') || instance.application.size() > kMaxPath)) {
    reader.problem(
        "application",
        fmt::format("'{}' is not allowed; allowed is an absolute path on the host, of up to {} characters",
                    shown(instance.application), kMaxPath));
  }
  if (!state.empty()) instance.running = state == kStates.front();
  std::set<std::string> events;
  for (const std::string& event : instance.events) {
    if (const auto good = check_name("event", event, kMaxEventName); !good)
      reader.problem("events", good.error().message);
    if (!events.insert(event).second)
      reader.problem("events", fmt::format("'{}' is there twice", shown(event)));
  }
  return instance;
}

}  // namespace

std::expected<Plant, PlantErrors> parse_plant(std::string_view text, const std::string& file) {
  PlantReader reader;
  reader.plant.file = file;
  if (const auto root = parse_toml(text)) {
    reader.read(*root);
  } else {
    reader.problems.push_back(root.error());
  }
  if (reader.problems.empty()) return std::move(reader.plant);
  std::ranges::stable_sort(reader.problems, {}, &ConfigProblem::line);
  PlantErrors errors;
  for (const ConfigProblem& problem : reader.problems) {
    errors.push_back(describe(file, problem));
  }
  return std::unexpected(std::move(errors));
}

std::expected<Plant, PlantErrors> load_plant(const std::string& file) {
  std::ifstream stream;
  if (file != "-") {
    stream.open(file, std::ios::binary);
    if (!stream) return std::unexpected(PlantErrors{fmt::format("{}: {}", file, std::strerror(errno))});
  }
  std::istream& input = file == "-" ? std::cin : stream;
  std::string text(kMaxPlantBytes + 1, '\0');
  input.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(input.gcount()));
  if (input.bad()) return std::unexpected(PlantErrors{fmt::format("{}: {}", file, std::strerror(errno))});
  if (text.size() > kMaxPlantBytes) {
    return std::unexpected(
        PlantErrors{fmt::format("{}: is larger than the {} bytes that are allowed", file, kMaxPlantBytes)});
  }
  return parse_plant(text, file);
}

}  // namespace plchost
