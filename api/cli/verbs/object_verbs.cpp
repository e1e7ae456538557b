#include "api/cli/verbs/object_verbs.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <iterator>
#include <memory>
#include <utility>

#include <fmt/format.h>

#include "api/cli/interrupt.hpp"
#include "api/cli/output.hpp"
#include "api/cli/rows/object_rows.hpp"
#include "api/cli/rows/rows.hpp"
#include "api/dds/page_sample.hpp"
#include "shm/base/names.hpp"
#include "shm/base/time.hpp"

namespace plchost {

namespace {

struct ListArguments {
  std::string pattern;
  std::string type;
};

struct WatchObjectArguments {
  std::string name;
  double interval_s = 0.2;
  std::uint64_t count = 0;  // 0: until Ctrl-C
};

Result<ObjectQuery> query_of(const ListArguments& arguments) {
  ObjectQuery query{.name = {}, .type = std::nullopt, .match = arguments.pattern, .after = {}};
  if (arguments.type.empty()) return query;
  PLCHOST_TRY_ASSIGN(query.type, parse_object_type(arguments.type));
  return query;
}

std::string type_names() {
  std::array<std::string_view, kObjectTypes> names;
  std::ranges::transform(kObjectTraits, names.begin(), &ObjectTraits::name);
  return join_names(names);
}

// All pages of one host. The timeout is that of one page.
Result<std::vector<ListedObject>> all_pages(CliSession& session, const std::string& host, ObjectQuery query) {
  std::vector<ListedObject> objects;
  for (bool goes_on = true; goes_on;) {
    PLCHOST_TRY_ASSIGN(auto page, session.client().value()->list_objects(host, query, session.deadline()));
    PLCHOST_TRY_ASSIGN(goes_on, next_page(host, page, query));
    std::ranges::move(page.objects, std::back_inserter(objects));
  }
  return objects;
}

struct HostObjects {
  std::string host;
  std::vector<ListedObject> objects;
};

// Row by row: as rows, 100,000 objects would fill the memory.
void print_json(const std::vector<HostObjects>& hosts) {
  std::string separator = "[\n  ";
  for (const HostObjects& of : hosts) {
    for (const ListedObject& object : of.objects) {
      fmt::print("{}{}", separator, json_text(to_row(of.host, object)));
      separator = ",\n  ";
    }
  }
  fmt::print("{}\n", separator.starts_with('[') ? "[]" : "\n]");
}

std::vector<Row> all_rows(const std::vector<HostObjects>& hosts) {
  std::vector<Row> rows;
  for (const HostObjects& of : hosts) {
    for (const ListedObject& object : of.objects) rows.push_back(to_row(of.host, object));
  }
  return rows;
}

std::vector<Row> short_rows(const std::vector<HostObjects>& hosts) {
  std::vector<Row> rows;
  for (const HostObjects& of : hosts) {
    for (const ListedObject& object : of.objects) rows.push_back(to_short_row(of.host, object));
  }
  return rows;
}

int list_objects(CliSession& session, const ListArguments& arguments) {
  const auto query = query_of(arguments);
  if (!query) return CliSession::fail(query.error());
  const auto hosts = session.shown_hosts();
  if (!hosts) return CliSession::fail(hosts.error());
  std::vector<HostObjects> found;
  for (const HostView& host : *hosts) {
    auto objects = all_pages(session, host.name, *query);
    if (!objects) return CliSession::fail(objects.error());
    found.push_back({host.name, *std::move(objects)});
  }
  if (session.options.csv || !session.options.columns.empty() || !session.options.sort_by.empty()) {
    return session.show(all_rows(found), object_columns());
  }
  if (!session.options.json) return session.show(short_rows(found), object_columns());
  print_json(found);
  return kExitDone;
}

// To the host, an empty name stands for all objects.
Result<std::string> host_of_object(CliSession& session, const std::string& name) {
  if (name.empty()) {
    return failure(ErrorCode::invalid_argument,
                   "NAME is empty: name one object; 'plcctl list objects' lists all");
  }
  return session.target_host();
}

Result<ListedObject> look_at(CliSession& session, const std::string& host, const std::string& name) {
  PLCHOST_TRY_ASSIGN(auto listing, session.client().value()->list_objects(
                                       host, {.name = name, .type = std::nullopt, .match = {}, .after = {}},
                                       session.deadline()));
  if (listing.objects.size() == 1) return std::move(listing.objects.front());
  return failure(ErrorCode::corrupt, fmt::format("host '{}' tells of {} objects where one was asked for",
                                                 host, listing.objects.size()));
}

int show_object(CliSession& session, const std::string& name) {
  const auto host = host_of_object(session, name);
  if (!host) return CliSession::fail(host.error());
  const auto object = look_at(session, *host, name);
  if (!object) return CliSession::fail(object.error());
  fmt::print("{}",
             session.options.json ? format_json({to_row(*host, *object)}) : format_object(*host, *object));
  return kExitDone;
}

// One look of a watch: printed when it differs from the look before.
struct ObjectLook {
  Row row;  // as JSON, without the time
  std::string text;
};

ObjectLook look_of(const std::string& host, const ListedObject& object) {
  const plc_ObjectRecord& record = object.record;
  constexpr std::size_t kHoldersInLine = 8;
  const std::string by = holders_text(object, kHoldersInLine);
  ObjectLook look{
      .row = to_row(host, object),
      .text = fmt::format("{}, {}, {}{}{}", state_text(object), count_text(record.waiters, "waiter"),
                          count_text(record.reference_count, "reference"), by.empty() ? "" : ": ", by)};
  look.row["present"] = true;
  return look;
}

ObjectLook look_of_nothing(const std::string& host, const std::string& name) {
  return {.row = {{"host", host}, {"object", name}, {"present", false}}, .text = "is not there"};
}

void print_look(const CliSession& session, const std::string& name, const ObjectLook& look) {
  const std::int64_t now = unix_time_ns();
  if (session.options.json) {
    Row row{{"time", time_text(now)}, {"time_unix_ns", now}};
    row.update(look.row);
    fmt::print("{}\n", json_text(row));
  } else {
    fmt::print("{}  {}  {}\n", time_text(now), printable(name), printable(look.text));
  }
  flush_output();
}

int watch_object(CliSession& session, const WatchObjectArguments& arguments) {
  catch_interrupts();
  const auto host = host_of_object(session, arguments.name);
  if (!host) return CliSession::fail(host.error());
  const auto interval =
      std::chrono::duration_cast<Duration>(std::chrono::duration<double>(arguments.interval_s));
  Row last;
  std::uint64_t shown = 0;
  for (TimePoint next = MonotonicClock::now(); !interrupted();) {
    const auto object = look_at(session, *host, arguments.name);
    // One that goes may come again; one that was never there is a slip of the pen.
    const bool gone = !object && object.error().code == ErrorCode::not_found && shown > 0;
    if (!object && !gone) return CliSession::fail(object.error());
    const ObjectLook look = object ? look_of(*host, *object) : look_of_nothing(*host, arguments.name);
    if (look.row != last) {
      print_look(session, arguments.name, look);
      last = look.row;
      if (++shown == arguments.count) break;
    }
    next = std::max(next + interval, MonotonicClock::now());
    sleep_until_interrupted(next);
  }
  return kExitDone;
}

}  // namespace

void add_list_objects(const Command& verb, CliSession& session) {
  const auto arguments = std::make_shared<ListArguments>();
  verb.noun("objects", "The objects of the pool: types, contents, and the processes that hold them",
            [&session, arguments] { return list_objects(session, *arguments); })
      .optional("PATTERN", arguments->pattern, "only names like this: '*' any characters, '?' one")
      .optional("--type", arguments->type, fmt::format("only one type: {}", type_names()).c_str());
}

void add_show_object(const Command& verb, CliSession& session) {
  const auto name = std::make_shared<std::string>();
  verb.noun("object", "One object of the pool, with all who hold it",
            [&session, name] { return show_object(session, *name); })
      .argument("NAME", *name);
}

void add_watch_object(const Command& verb, CliSession& session) {
  const auto arguments = std::make_shared<WatchObjectArguments>();
  constexpr double kMinInterval = 0.02;
  constexpr double kMaxInterval = 3600;
  verb.noun("object", "One object of the pool: a line (with --json an object) for each change, until Ctrl-C",
            [&session, arguments] { return watch_object(session, *arguments); })
      .argument("NAME", arguments->name)
      .option("--interval", arguments->interval_s, "seconds between two looks (default 0.2)", kMinInterval,
              kMaxInterval)
      .option("--count", arguments->count, "end after so many lines", std::uint64_t{0}, kMaxCount);
}

}  // namespace plchost
