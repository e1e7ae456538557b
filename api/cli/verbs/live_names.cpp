#include "api/cli/verbs/live_names.hpp"

#include <algorithm>
#include <functional>
#include <iterator>
#include <map>

#include <fmt/format.h>

#include "api/cli/rows/object_rows.hpp"
#include "api/cli/rows/rows.hpp"
#include "api/cli/rows/status_rows.hpp"
#include "api/client/status_count.hpp"
#include "api/dds/text.hpp"
#include "shm/base/names.hpp"

namespace plchost {

namespace {

// On the Tab key an answer is wanted at once; with thousands of objects, type a letter first.
constexpr std::size_t kMostObjects = 1000;

using Names = std::vector<Candidate>;
/// Appends the names of one host.
using Source = std::function<void(ControlClient&, const HostView&, TimePoint, Names&)>;

void add_host(ControlClient& /*client*/, const HostView& host, TimePoint /*deadline*/, Names& names) {
  names.push_back({host.name, count_text(count_of<plc_InstanceStatus>(host.status).value_or(0), "instance")});
}

/// `name` and `text` make a candidate of a sample's row.
template <class Sample, class Name, class Text>
Source from(Snapshot<Sample> snapshot, Name name, Text text) {
  return [=](ControlClient& client, const HostView& host, TimePoint deadline, Names& names) {
    const auto samples = (client.*snapshot)(host.name, deadline);
    if (!samples) return;
    for (const Sample& sample : *samples) {
      const Row row = to_row(sample);
      names.push_back({name(row), text(row)});
    }
  };
}

std::string field(const Row& row, const char* name) {
  const auto& value = row.at(name);
  return value.is_string() ? value.get<std::string>() : value.dump();
}

Source instances() {
  return from(
      &ControlClient::instances, [](const Row& row) { return field(row, "name"); },
      [](const Row& row) { return field(row, "state"); });
}

Source tasks() {
  return from(
      &ControlClient::tasks, [](const Row& row) { return field(row, "instance") + "/" + field(row, "task"); },
      [](const Row& row) { return field(row, "kind") + ", " + field(row, "state"); });
}

Source events() {
  return from(
      &ControlClient::events,
      [](const Row& row) { return field(row, "instance") + "/" + field(row, "event"); },
      [](const Row& row) { return count_text(row.value("posts", std::uint64_t{0}), "post"); });
}

void add_objects(ControlClient& client, const HostView& host, TimePoint deadline, Names& names) {
  ObjectQuery query;
  while (names.size() < kMostObjects) {
    const auto page = client.list_objects(host.name, query, deadline);
    if (!page) return;
    for (const ListedObject& one : page->objects) {
      names.push_back({std::string(one.name()), state_text(one)});
    }
    if (page->complete || page->next_after <= query.after) return;
    query.after = page->next_after;
  }
}

void add_nodes(ControlClient& client, const HostView& host, TimePoint deadline, Names& names) {
  const auto listing = client.list_nodes(host.name, {}, deadline);
  if (!listing) return;
  for (const plc_NodeRecord& node : listing->nodes)
    names.push_back({std::string(dds::text_of(node.name)), std::string(dds::text_of(node.program))});
}

void add_schedulers(ControlClient& /*client*/, const HostView& host, TimePoint /*deadline*/, Names& names) {
  for (const std::string& name : host.schedulers()) names.push_back({name, ""});
}

const std::multimap<std::string_view, Source>& sources() {
  static const std::multimap<std::string_view, Source> all{
      {"--host", add_host},          {"INSTANCE", instances()},  {"INSTANCE[/TASK]", instances()},
      {"INSTANCE[/TASK]", tasks()},  {"INSTANCE/TASK", tasks()}, {"INSTANCE/EVENT", events()},
      {"SCHEDULER", add_schedulers}, {"NAME", add_objects},      {"PATTERN", add_objects},
      {"NODE", add_nodes},
  };
  return all;
}

}  // namespace

std::vector<Candidate> live_names(CliSession& session, std::string_view form) {
  Names names;
  const auto [first, last] = sources().equal_range(form);
  if (first == last) return names;
  if (form == "--host") session.options.hosts = {};
  const auto hosts = session.shown_hosts();
  if (!hosts) return names;
  for (const HostView& host : *hosts) {
    for (auto source = first; source != last; ++source) {
      source->second(*session.client().value(), host, session.deadline(), names);
    }
  }
  std::ranges::stable_sort(names, {}, &Candidate::word);
  const auto twice = std::ranges::unique(names, {}, &Candidate::word);
  names.erase(twice.begin(), twice.end());
  return names;
}

}  // namespace plchost
