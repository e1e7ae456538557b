#include "instances/adapters/iec/task_file.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <variant>
#include <vector>

#include <fmt/format.h>

#include "instances/adapters/iec/duration.hpp"
#include "instances/adapters/iec/tokens.hpp"
#include "schedulers/policies/registry.hpp"
#include "shm/base/names.hpp"
#include "shm/toml/section_reader.hpp"
#include "shm/toml/toml_document.hpp"

namespace plchost::iec {

namespace {

using namespace std::string_view_literals;

// In the order of their enumerators.
constexpr std::array kLatePolicies = {"next"sv, "asap"sv};
constexpr std::array kWatchdogPolicies = {"application"sv, "task"sv};
constexpr std::array kGlobals = {"shared"sv, "copy"sv};
constexpr std::array kWidths = {"shared"sv, "separate"sv};
static_assert(std::to_underlying(LatePolicy::asap) == 1);
static_assert(std::to_underlying(WatchdogPolicy::task) == 1);
static_assert(std::to_underlying(Widths::separate) == 1);

constexpr std::string_view kSchedulerIsElsewhere =
    "one scheduler runs all tasks of an instance; write it before the first table, or in [resource.NAME]";

constexpr std::size_t kMostProblems = 100;  // more are not told

/// A task of the configuration that a table may name.
struct KnownTask {
  const Resource* resource;
  const std::string* name;
  TaskExtension* extension;
  std::int64_t interval_ns;  ///< of a cyclic one; 0: it is another one
};

struct KnownProgram {
  const Resource* resource;
  const std::string* name;
  bool* copies_globals;
};

class TaskFileReader {
 public:
  TaskFileReader(const Source& file, Configuration& configuration)
      : file_(file), locations_(configuration.locations) {
    for (Resource& resource : configuration.resources) {
      resources_.push_back(&resource);
      for (Task& task : resource.tasks) {
        tasks_.push_back(
            {&resource, &task.name, &task.extension, task.single.empty() ? task.interval_ns.value_or(0) : 0});
      }
      for (Program& program : resource.programs) {
        programs_.push_back({&resource, &program.name, &program.copies_globals});
        if (program.task.empty()) tasks_.push_back({&resource, &program.name, &program.extension, 0});
      }
    }
  }

  SourceProblems read() {
    if (const auto root = parse_toml(file_.text); !root) {
      problems_.push_back(root.error());
    } else {
      read_root(*root);
    }
    std::ranges::sort(problems_, [](const ConfigProblem& a, const ConfigProblem& b) {
      return std::tie(a.line, a.column, a.text) < std::tie(b.line, b.column, b.text);
    });
    SourceProblems result;
    for (ConfigProblem& problem : problems_) {
      result.push_back({{file_.file, problem.line, problem.column}, printable(std::move(problem.text))});
    }
    return result;
  }

 private:
  void problem(const TomlValue& value, std::string text) {
    problems_.push_back({.line = value.line, .text = std::move(text), .column = value.column});
  }
  const TomlTable* table(const TomlValue& value, std::string_view form) {
    const auto* const found = std::get_if<TomlTable>(&value.value);
    if (found == nullptr) problem(value, fmt::format("{} is no table; write [{}]", value.shown(), form));
    return found;
  }

  void read_root(const TomlTable& root) {
    for (const auto& [key, value] : root) {
      if (key == "resource") {
        read_resources(value);
      } else if (key == "scheduler") {
        for (Resource* const resource : resources_) read_scheduler(value, *resource);
      } else if (key == "locations") {
        read_widths(value);
      } else if (key == "location") {
        read_locations(value);
      } else if (!read_part(key, value, nullptr)) {
        refuse(key, value,
               "scheduler, locations, [location], [task.NAME], [program.NAME], [resource.NAME.task.NAME] and "
               "[resource.NAME.program.NAME]");
      }
    }
  }
  bool read_part(const std::string& key, const TomlValue& value, const Resource* resource) {
    if (key == "task") read_tasks(value, resource);
    if (key == "program") read_programs(value, resource);
    return key == "task" || key == "program";
  }
  void refuse(const std::string& key, const TomlValue& value, std::string_view allowed) {
    problem(value, fmt::format("'{}' is not expected here; allowed are {}", shown(key), allowed));
  }
  // That of a resource is read first: it wins.
  void read_scheduler(const TomlValue& value, Resource& resource) {
    const auto* const name = std::get_if<std::string>(&value.value);
    if (name == nullptr || std::ranges::find(kSchedulerNames, *name) == kSchedulerNames.end()) {
      return problem(value, fmt::format("scheduler: {} is no scheduler; allowed are {}", value.shown(),
                                        join_names(kSchedulerNames)));
    }
    if (resource.scheduler.empty()) resource.scheduler = *name;
  }

  void read_widths(const TomlValue& value) {
    const auto* const word = std::get_if<std::string>(&value.value);
    const auto* const known = word == nullptr ? kWidths.end() : std::ranges::find(kWidths, *word);
    if (known == kWidths.end()) {
      return problem(value, fmt::format("locations: {} is not known; allowed are {}", value.shown(),
                                        join_names(kWidths)));
    }
    locations_.widths = static_cast<Widths>(known - kWidths.begin());
  }
  void read_locations(const TomlValue& value) {
    const TomlTable* const lines = table(value, "location");
    if (lines == nullptr) return;
    for (const auto& [key, one] : *lines) {
      if (problems_.size() >= kMostProblems) return;
      read_location(key, one);
    }
  }
  // "%IW0.0.0.2" = "%IW2"
  void read_location(const std::string& key, const TomlValue& value) {
    auto location = location_of(key);
    if (!location) {
      return problem(value, fmt::format("'{}' is no location; a line of [location] is like \"%IW0.0.0.2\" = "
                                        "\"%IW2\"",
                                        shown(key)));
    }
    const auto* const text = std::get_if<std::string>(&value.value);
    auto given = location_of(text == nullptr ? "" : *text);
    const auto alike = [](const Location& one) { return std::tuple(one.area, one.bytes, one.is_bit); };
    if (!given || !given->is_direct() || alike(*given) != alike(*location)) {
      const Location like{.area = location->area,
                          .numbers = location->is_bit ? std::vector{2U, 0U} : std::vector{2U},
                          .bytes = location->bytes,
                          .is_bit = location->is_bit};
      return problem(value, fmt::format("location {}: {} is not allowed; allowed is a place of its area and "
                                        "width, like \"{}\"",
                                        location->text(), value.shown(), like.text()));
    }
    const auto [known, is_new] = locations_.given.try_emplace(
        *std::move(location),
        LocationOptions::Given{*std::move(given), {file_.file, value.line, value.column}});
    if (!is_new) {
      problem(value, fmt::format("the location {} is given in line {}, too; remove one of both",
                                 known->first.text(), known->second.place.line));
    }
  }

  void read_resources(const TomlValue& value) {
    const TomlTable* const resources = table(value, "resource.NAME.task.NAME");
    if (resources == nullptr) return;
    for (const auto& [name, one] : *resources) {
      Resource* const resource = find_resource(name, one);
      const TomlTable* const members = table(one, "resource.NAME.task.NAME");
      if (resource == nullptr || members == nullptr) continue;
      for (const auto& [key, part] : *members) {
        if (key == "scheduler") {
          read_scheduler(part, *resource);
        } else if (!read_part(key, part, resource)) {
          refuse(key, part, "scheduler, [resource.NAME.task.NAME] and [resource.NAME.program.NAME]");
        }
      }
    }
  }
  Resource* find_resource(const std::string& name, const TomlValue& value) {
    std::vector<std::string_view> names;
    for (Resource* const resource : resources_) {
      if (!resource->name.empty() && folded(resource->name) == folded(name)) return resource;
      if (!resource->name.empty()) names.push_back(resource->name);
    }
    problem(value, fmt::format("there is no RESOURCE '{}'; there are {}{}", shown(name), join_names(names),
                               suggestion(name, names)));
    return nullptr;
  }

  void read_tasks(const TomlValue& value, const Resource* resource) {
    read_each("task", tasks_, value, resource,
              [&](const KnownTask& task, const TomlTable& keys, const TomlValue& one) {
                if (task.extension->place.line != 0) {
                  return problem(one, fmt::format("the task {} is given in line {}, too; remove one of both",
                                                  *task.name, task.extension->place.line));
                }
                task.extension->place = {file_.file, one.line, one.column};
                read_task(task, keys, one.line);
              });
  }
  void read_programs(const TomlValue& value, const Resource* resource) {
    read_each("program", programs_, value, resource,
              [&](const KnownProgram& program, const TomlTable& keys, const TomlValue& one) {
                const auto [before, is_first] = lines_of_programs_.try_emplace(program.name, one.line);
                if (!is_first) {
                  return problem(one,
                                 fmt::format("the program {} is given in line {}, too; remove one of both",
                                             *program.name, before->second));
                }
                SectionReader reader(keys, one.line, fmt::format("program {}", *program.name), problems_);
                reader.tell_columns();
                *program.copies_globals = read_choice(reader, "globals", kGlobals) == 1;
                reader.refuse_unknown_keys();
              });
  }
  /// Calls `read` for each of the tables [KIND.NAME] whose name is known.
  template <class Known, class Read>
  void read_each(std::string_view kind, const std::vector<Known>& all, const TomlValue& value,
                 const Resource* resource, const Read& read) {
    const std::string form = fmt::format("{}.NAME", kind);
    const TomlTable* const parts = table(value, form);
    if (parts == nullptr) return;
    for (const auto& [name, one] : *parts) {
      if (problems_.size() >= kMostProblems) return;
      const Known* const known = find(kind, all, name, one, resource);
      const TomlTable* const keys = table(one, form);
      if (known != nullptr && keys != nullptr) read(*known, *keys, one);
    }
  }
  template <class Known>
  const Known* find(std::string_view kind, const std::vector<Known>& all, const std::string& name,
                    const TomlValue& value, const Resource* resource) {
    const Known* found = nullptr;
    std::vector<std::string_view> names;
    for (const Known& one : all) {
      if (resource != nullptr && one.resource != resource) continue;
      names.push_back(*one.name);
      if (folded(*one.name) != folded(name)) continue;
      if (found != nullptr && found->resource != one.resource) {
        problem(value, fmt::format("the resources {0} and {1} have a {2} {3}; write [resource.{0}.{2}.{3}]",
                                   found->resource->name, one.resource->name, kind, *one.name));
        return nullptr;
      }
      found = &one;
    }
    if (found == nullptr) {
      problem(value, fmt::format("there is no {} '{}'; there are {}{}", kind, shown(name), join_names(names),
                                 suggestion(name, names)));
    }
    return found;
  }

  void read_task(const KnownTask& task, TomlTable keys, unsigned line) {
    if (const auto scheduler = keys.extract("scheduler"); !scheduler.empty()) {
      problem(scheduler.mapped(), fmt::format("task {} scheduler: {}", *task.name, kSchedulerIsElsewhere));
    }
    SectionReader reader(keys, line, fmt::format("task {}", *task.name), problems_);
    reader.tell_columns();
    read_event(reader, task.extension->external_event);
    TaskOptions options;
    options.late = static_cast<LatePolicy>(read_choice(reader, "late_policy", kLatePolicies));
    read_duration(reader, keys, "start_offset", kMaxInterval, Duration(1), options.start_offset);
    reader.truth("drives_outputs", options.drives_outputs);
    TaskWatchdog& watchdog = options.watchdog;
    read_duration(reader, keys, "watchdog_time", kMaxWatchdogTime, std::chrono::microseconds(1),
                  watchdog.time);
    read_count(reader, "watchdog_sensitivity", 1, watchdog.sensitivity);
    read_count(reader, "watchdog_omitted_cycles", 0, watchdog.omitted_cycles);
    watchdog.policy = static_cast<WatchdogPolicy>(read_choice(reader, "watchdog_policy", kWatchdogPolicies));
    check_grid(reader, task, options);
    if (keys.size() > (reader.has("external_event") ? 1U : 0U)) task.extension->options = options;
    reader.refuse_unknown_keys();
  }

  static void read_event(SectionReader& reader, std::string& event) {
    std::string name;
    reader.text("external_event", name);
    if (!reader.has_text("external_event") || reader.wrong("external_event")) return;
    if (const auto good = check_name("the name of an event", name, kMaxEventName); !good) {
      return reader.problem("external_event", good.error().message);
    }
    event = name;
  }
  static std::size_t read_choice(SectionReader& reader, std::string_view key,
                                 std::span<const std::string_view> words) {
    std::string word(words.front());
    reader.choice(key, words, word);
    return static_cast<std::size_t>(std::ranges::find(words, word) - words.begin());
  }
  static void read_count(SectionReader& reader, std::string_view key, std::int64_t least,
                         std::uint32_t& target) {
    std::int64_t count = target;
    reader.number(key, least, kMaxWatchdogCount, count);
    target = static_cast<std::uint32_t>(count);
  }
  static void read_duration(SectionReader& reader, const TomlTable& keys, std::string_view key, Duration most,
                            Duration step, Duration& target) {
    reader.know(key);
    const auto found = keys.find(key);
    if (found == keys.end()) return;
    const auto* const written = std::get_if<std::string>(&found->second.value);
    if (written == nullptr) {
      return reader.problem(key, fmt::format("{} is {}; allowed is a duration in quotes, like \"5ms\"",
                                             found->second.shown(), found->second.type_name()));
    }
    const std::string& text = *written;
    const auto ns = nanoseconds_of("T#" + text);
    if (!ns) {
      return reader.problem(key, fmt::format("\"{}\" is no duration; allowed is \"1ms500us\", with the units "
                                             "d, h, m, s, ms, us, ns",
                                             shown(text)));
    }
    if (*ns < 0 || *ns > most.count() || *ns % step.count() != 0) {
      return reader.problem(key, fmt::format("\"{}\" is out of range; allowed is 0s to {}{}", shown(text),
                                             step > Duration(1) ? std::to_string(most / step) + "us" : "50d",
                                             step > Duration(1) ? " in whole microseconds" : ""));
    }
    target = Duration(*ns);
  }
  // Only what is planned can be moved against others, or late.
  static void check_grid(SectionReader& reader, const KnownTask& task, const TaskOptions& options) {
    const bool is_cyclic = task.interval_ns != 0 && !reader.has("external_event");
    for (const std::string_view key : {"late_policy"sv, "start_offset"sv}) {
      if (reader.has(key) && !is_cyclic) {
        reader.problem(key,
                       "this task is not cyclic; allowed is this key only with an INTERVAL that runs it");
      }
    }
    if (is_cyclic && options.start_offset.count() >= task.interval_ns) {
      reader.problem("start_offset",
                     fmt::format("is not below the task's INTERVAL of {} ns", task.interval_ns));
    }
  }

  const Source& file_;
  LocationOptions& locations_;
  std::vector<Resource*> resources_;
  std::vector<KnownTask> tasks_;
  std::vector<KnownProgram> programs_;
  std::map<const std::string*, unsigned> lines_of_programs_;  // those that are given
  std::vector<ConfigProblem> problems_;
};

}  // namespace

SourceProblems read_task_file(const Source& file, Configuration& configuration) {
  return TaskFileReader(file, configuration).read();
}

}  // namespace plchost::iec
