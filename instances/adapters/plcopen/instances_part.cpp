#include "instances/adapters/plcopen/instances_part.hpp"

#include <algorithm>
#include <iterator>
#include <map>
#include <ranges>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "instances/adapters/iec/tokens.hpp"
#include "instances/adapters/plcopen/declarations.hpp"
#include "instances/adapters/plcopen/iso_duration.hpp"
#include "instances/adapters/plcopen/structured_text.hpp"
#include "instances/adapters/plcopen/write_elements.hpp"
#include "shm/base/names.hpp"

namespace plchost::plcopen {

namespace {

using pugi::xml_node;

/// The settings of a task that CODESYS adds.
xml_node codesys_settings(const xml_node& task) {
  return task.child("addData")
      .find_child([](const xml_node& data) { return static_cast<bool>(data.child("TaskSettings")); })
      .child("TaskSettings");
}

class ConfigurationReader {
 public:
  ConfigurationReader(ProjectFile& file, GeneratedText& text) : file_(file), text_(text) {}

  void add(const xml_node& configuration) {
    const std::string name = file_.identifier(configuration, "name", "a configuration");
    where_ = "configuration " + name;
    text_.add("CONFIGURATION " + name, file_.line_of(configuration));
    std::vector<xml_node> globals;
    std::vector<xml_node> resources;
    const auto refuse_any = [&](const xml_node& list) {
      if (list.first_child())
        file_.refuse(list, fmt::format("{}: <{}> is not taken", where_, file_.name_of(list)));
    };
    file_.read(configuration, where_,
               {{"globalVars", [&](const xml_node& one) { globals.push_back(one); }},
                {"resource", [&](const xml_node& one) { resources.push_back(one); }},
                {"accessVars", refuse_any},
                {"configVars", refuse_any}});
    for (const xml_node& one : globals) add_globals(one);
    for (const xml_node& one : resources) add_resource(one);
    text_.add("END_CONFIGURATION", file_.line_of(configuration));
  }

 private:
  void refuse(const xml_node& element, std::string_view why) {
    file_.refuse(element, fmt::format("{}: {}", where_, why));
  }

  // CODESYS says in addition which of the variables are of which section, if they are of several.
  void add_globals(const xml_node& list) {
    for (const xml_node& data : list.child("addData").children()) {
      const xml_node mixed = data.child("MixedAttrsVarList");
      for (const xml_node& part : mixed.children("globalVars"))
        add_section(file_, part, "VAR_GLOBAL", where_, text_);
      if (mixed) return;
    }
    add_section(file_, list, "VAR_GLOBAL", where_, text_);
  }

  void add_resource(const xml_node& resource) {
    const std::string name = file_.identifier(resource, "name", where_);
    where_ = "resource " + name;
    resource_ = name;
    programs_.clear();
    std::vector<xml_node> tasks;
    std::vector<xml_node> globals;
    file_.read(resource, where_,
               {{"task", [&](const xml_node& one) { tasks.push_back(one); }},
                {"globalVars", [&](const xml_node& one) { globals.push_back(one); }},
                {"pouInstance", [&](const xml_node& one) { take_program(one, ""); }},
                // They are told where all types are.
                {"pou", [](const xml_node&) {}},
                {"dataType", [](const xml_node&) {}}});
    text_.add(fmt::format("RESOURCE {} ON PLC", name), file_.line_of(resource));
    for (const xml_node& one : globals) add_globals(one);
    // Those without a task stand behind the others.
    std::vector<Program> without = std::exchange(programs_, {});
    for (const xml_node& one : tasks) add_task(one);
    std::ranges::move(without, std::back_inserter(programs_));
    if (programs_.size() > kMostPrograms)
      return refuse(resource, fmt::format("it has more than {} instances of programs", kMostPrograms));
    for (Program& program : programs_) add_program(program);
    text_.add("END_RESOURCE", file_.line_of(resource));
  }

  void add_task(const xml_node& task) {
    const std::string name = file_.identifier(task, "name", where_);
    const xml_node settings = codesys_settings(task);
    if (is_true(settings.child("Watchdog"), "Enabled"))
      file_.remark(task,
                   fmt::format("task {}: its watchdog is not taken; a task file has watchdog_time", name));
    const bool freewheels = std::string_view(settings.attribute("KindOfTask").value()) == "Freewheeling";
    file_.read(task, "task " + name,
               {{"pouInstance", [&](const xml_node& one) { take_program(one, freewheels ? "" : name); }}});
    if (freewheels) {
      return file_.remark(task, fmt::format("task {} is freewheeling: each of its programs becomes a task of "
                                            "its own name",
                                            name));
    }
    std::string parts;
    if (const std::string single = task.attribute("single").value(); !single.empty()) {
      if (!std::ranges::all_of(std::views::split(single, '.'), [](const auto& part) {
            return is_identifier(std::string_view(part.begin(), part.end()));
          }))
        refuse(task, fmt::format("task {}: single '{}' is no variable", name, shown(single)));
      parts += fmt::format("SINGLE := {}, ", single);
    }
    parts += interval_of(task, name);
    const std::string_view priority = task.attribute("priority").value();
    if (priority.empty() || !std::ranges::all_of(priority, [](char c) { return c >= '0' && c <= '9'; }))
      refuse(task, fmt::format("task {}: priority '{}' is no number", name, shown(priority)));
    text_.add(fmt::format("TASK {} ({}PRIORITY := {});", name, parts, priority), file_.line_of(task));
    add_event(task, name);
  }

  void add_event(const xml_node& task, const std::string& name) {
    const std::string event = external_event_of(task);
    if (event.empty()) return;
    if (const auto good = check_name("the name of an event", event, kMaxEventName); !good)
      return refuse(task, fmt::format("task {}: {}", name, good.error().message));
    text_.add(TaskEvent{.resource = resource_, .task = name, .event = event});
  }

  std::string interval_of(const xml_node& task, const std::string& name) {
    const std::string text = task.attribute("interval").value();
    if (text.empty()) return "";
    if (const auto duration = iso_nanoseconds(text))
      return fmt::format("INTERVAL := {}, ", time_literal(*duration));
    const iec::Tokens tokens = iec::tokens_of(text, "");
    if (tokens.all.size() == 2 && tokens.all.front().kind == iec::Token::Kind::literal)
      return fmt::format("INTERVAL := {}, ", tokens.all.front().text);
    refuse(task,
           fmt::format("task {}: interval '{}' is no duration; allowed are those like T#20ms and PT0.02S",
                       name, shown(text)));
    return "";
  }

  struct Program {
    std::string name;
    std::string type;
    std::string task;  // empty: none
    xml_node element;
  };

  // CODESYS names the program only, and no instance of it.
  void take_program(const xml_node& instance, const std::string& task) {
    Program program{
        .name = file_.identifier(instance, "name", where_), .type = "", .task = task, .element = instance};
    program.type = instance.attribute("typeName").empty() || !*instance.attribute("typeName").value()
                       ? program.name
                       : file_.identifier(instance, "typeName", where_);
    file_.read(instance, where_, {});
    programs_.push_back(std::move(program));
  }

  void add_program(Program& program) {
    if (iec::folded(program.name) == iec::folded(program.type)) {
      std::string name;
      do {
        name = fmt::format("{}_{}", program.type, ++numbers_[iec::folded(program.type)]);
      } while (is_taken(name));
      file_.remark(
          program.element,
          fmt::format("the instance of {} is called {}: ST cannot tell the two apart", program.type, name));
      program.name = name;
    }
    const std::string with = program.task.empty() ? "" : " WITH " + program.task;
    text_.add(fmt::format("PROGRAM {}{} : {};", program.name, with, program.type),
              file_.line_of(program.element));
  }
  [[nodiscard]] bool is_taken(const std::string& name) const {
    return std::ranges::any_of(
        programs_, [&](const Program& one) { return iec::folded(one.name) == iec::folded(name); });
  }

  ProjectFile& file_;
  GeneratedText& text_;
  std::string where_;
  std::string resource_;
  std::vector<Program> programs_;            // of this resource
  std::map<std::string, unsigned> numbers_;  // of the names that were given, by the folded type
};

}  // namespace

void add_configuration(ProjectFile& file, const xml_node& configuration, GeneratedText& text) {
  ConfigurationReader(file, text).add(configuration);
}

}  // namespace plchost::plcopen
