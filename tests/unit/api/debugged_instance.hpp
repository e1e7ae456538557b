#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <functional>
#include <iterator>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "api/cli/debug/debug_link.hpp"
#include "api/dds/text.hpp"
#include "shm/base/time.hpp"

namespace plchost {

inline plc_VariableRecord variable_record(std::string_view name, std::string_view type,
                                          std::string_view value) {
  plc_VariableRecord record{};
  dds::copy_text(record.name, name);
  dds::copy_text(record.type, type);
  dds::copy_text(record.value, value);
  return record;
}

/// Answers a debugger in the place of a host and its instance.
struct DebuggedInstance {
  nlohmann::json tasks = nlohmann::json::array();  ///< of its state
  std::vector<plc_VariableRecord> variables;
  std::vector<plc_VariableRecord> elements;  ///< of arrays among them, by their whole names
  /// Of each name with an index, if it is there.
  std::function<plc_VariableRecord(const std::string& name)> make_element;
  std::size_t asked_patterns = 0;  ///< in requests for variables
  Duration slowness{};             ///< the time of each of them
  TimePoint now = TimePoint(std::chrono::hours(1));
  std::vector<TimePoint> signs;                  ///< when its state was read
  std::vector<std::string> commands;             ///< that came, without the number of the session
  std::vector<std::string> written;              ///< NAME=VALUE
  bool busy = false;                             ///< it refuses commands
  std::string file;                              ///< in which it sets breakpoints; empty: it does not say
  std::string remark;                            ///< of its answers
  nlohmann::json breakpoints;                    ///< of its state; null: they are left out
  ErrorCode no_variable = ErrorCode::not_found;  ///< its answer for a name that it does not have

  /// Each variable to the value that it has; of arrays some elements.
  void force_all() {
    for (plc_VariableRecord& variable : variables) {
      variable.forced = true;
      if (!dds::text_of(variable.type).starts_with("ARRAY"))
        dds::copy_text(variable.forced_value, dds::text_of(variable.value));
    }
  }

  /// A halted task: its frames from the innermost on.
  void halt(const std::string& task, int number, const nlohmann::json& stack) {
    const nlohmann::json halted{
        {"task", task}, {"state", "halted"}, {"halt", number}, {"reason", "pause"}, {"stack", stack}};
    const auto known = std::ranges::find_if(tasks, [&](const auto& one) { return one["task"] == task; });
    if (known == tasks.end()) {
      tasks.push_back(halted);
    } else {
      *known = halted;
    }
  }

  [[nodiscard]] DebugRequests requests() {
    return {.call = [this](ControlVerb verb, const std::string& argument) { return answer(verb, argument); },
            .list_variables = [this](const VariableQuery& query) { return list(query); },
            .read_state = [this](const DebugQuery& /*query*/) -> Result<DebugPart> {
              signs.push_back(now);
              nlohmann::json told{{"session", 1}, {"tasks", tasks}};
              if (!breakpoints.is_null()) told["breakpoints"] = breakpoints;
              const std::string state = told.dump();
              return DebugPart{.version = 1, .size = state.size(), .text = state};
            },
            .now = [this] { return now; }};
  }

 private:
  Result<std::string> answer(ControlVerb verb, const std::string& argument) {
    if (verb == ControlVerb::write_variable) {
      written.push_back(argument);
      return std::string();
    }
    if (argument.starts_with("attach")) return std::string(R"({"session":1})");
    if (busy) return failure(ErrorCode::busy, "it is busy");
    commands.push_back(argument.substr(argument.find(' ') + 1));
    return nlohmann::json{{"id", 1}, {"line", 7}, {"file", file}, {"remark", remark}}.dump();
  }

  Result<VariableListing> list(const VariableQuery& query) {
    now += slowness;
    VariableListing page;
    if (query.patterns.empty()) page.variables.assign(variables.begin(), variables.end());
    asked_patterns += query.patterns.size();
    for (const std::string& pattern : query.patterns) {
      if (make_element && pattern.ends_with(']')) {
        page.variables.push_back(make_element(pattern));
        continue;
      }
      PLCHOST_TRY_ASSIGN(const auto found, like(pattern));
      std::ranges::copy(found.variables, std::back_inserter(page.variables));
    }
    return page;
  }
  // "PATH.*", or a whole name; that of an array is without its brackets.
  Result<VariableListing> like(std::string_view pattern) {
    const bool all = pattern.ends_with('*');
    if (all) pattern.remove_suffix(1);
    VariableListing page;
    std::ranges::copy_if(elements, std::back_inserter(page.variables),
                         [&](const auto& element) { return dds::text_of(element.name) == pattern; });
    std::ranges::copy_if(variables, std::back_inserter(page.variables), [&](const auto& variable) {
      const std::string_view name = dds::text_of(variable.name);
      return all ? name.starts_with(pattern) : name.substr(0, name.find('[')) == pattern;
    });
    if (page.variables.empty()) return failure(no_variable, fmt::format("no variable '{}'", pattern));
    return page;
  }
};

}  // namespace plchost
