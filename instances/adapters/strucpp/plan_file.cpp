#include "instances/adapters/strucpp/plan_file.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>
#include <initializer_list>
#include <set>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "instances/adapters/iec/duration.hpp"
#include "instances/adapters/iec/tokens.hpp"
#include "shm/base/names.hpp"

namespace plchost::strucpp {

namespace {

using nlohmann::json;
using namespace std::string_view_literals;

constexpr std::size_t kMostEntries = 100'000;  // of one list
constexpr std::size_t kMostText = 1'000'000;
constexpr std::size_t kMostName = 500;
constexpr int kMostPriority = 31;
constexpr int kMostIndex = 1'000'000'000;  // of an array, also below 0
constexpr int kMostDepth = 20;             // of lists and objects within each other; translate.mjs writes 9

constexpr std::string_view kLetters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_";

/// Ends the reading of a file: a value is not as translate.mjs writes it.
struct WrongPlan : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A value of the file, and the way to it for messages: configurations[0].name.
class Value {
 public:
  Value(const json& value, std::string path) : value_(value), path_(std::move(path)) {}

  [[noreturn]] void refuse(std::string_view allowed) const {
    std::string shown = value_.is_string() ? value_.get<std::string>() : value_.dump();
    if (shown.size() > 60) shown = shown.substr(0, 60) + "...";
    throw WrongPlan(fmt::format("{} is '{}'; allowed is {}", path_, printable(shown), allowed));
  }
  /// An object with exactly these keys.
  const Value& with(std::initializer_list<std::string_view> keys) const {
    if (!value_.is_object()) refuse("an object");
    for (const std::string_view key : keys) {
      if (!value_.contains(key)) throw WrongPlan(fmt::format("{} has no '{}'", path_, key));
    }
    for (const auto& [key, unused] : value_.items()) {
      if (std::ranges::find(keys, key) == keys.end())
        throw WrongPlan(fmt::format("{} has a '{}' that is not known", path_, printable(key)));
    }
    return *this;
  }
  Value operator[](std::string_view key) const {
    return {value_.at(std::string(key)), fmt::format("{}{}{}", path_, path_.empty() ? "" : ".", key)};
  }
  template <class Use>
  void each(Use&& use) const {
    if (!value_.is_array() || value_.size() > kMostEntries)
      refuse(fmt::format("a list of at most {} entries", kMostEntries));
    for (std::size_t i = 0; i < value_.size(); ++i) use(Value(value_[i], fmt::format("{}[{}]", path_, i)));
  }
  [[nodiscard]] std::string text(std::size_t most = kMostText) const {
    if (!value_.is_string() || value_.get_ref<const std::string&>().size() > most)
      refuse(fmt::format("a text of at most {} bytes", most));
    return value_.get<std::string>();
  }
  /// Of these letters only.
  [[nodiscard]] std::string text_of(std::string_view letters, std::string_view allowed,
                                    std::size_t most = kMostName) const {
    std::string text = this->text(most);
    if (text.find_first_not_of(letters) != std::string::npos) refuse(allowed);
    return text;
  }
  [[nodiscard]] std::string name() const {
    std::string name = text_of(kLetters, "a name of letters, digits and _");
    if (name.empty()) refuse("a name of letters, digits and _");
    return name;
  }
  [[nodiscard]] bool truth() const {
    if (!value_.is_boolean()) refuse("true or false");
    return value_.get<bool>();
  }
  [[nodiscard]] std::int64_t number(std::int64_t least, std::int64_t most) const {
    if (!value_.is_number_integer() || value_.get<std::int64_t>() < least ||
        value_.get<std::int64_t>() > most)
      refuse(fmt::format("{} to {}", least, most));
    return value_.get<std::int64_t>();
  }

 private:
  const json& value_;
  std::string path_;
};

struct SectionWord {
  std::string_view word;
  iec::Variable::Section section;
};
constexpr std::array<SectionWord, 8> kSections{{{"input", iec::Variable::Section::input},
                                                {"output", iec::Variable::Section::output},
                                                {"in_out", iec::Variable::Section::in_out},
                                                {"local", iec::Variable::Section::local},
                                                {"temporary", iec::Variable::Section::temporary},
                                                {"external", iec::Variable::Section::external},
                                                {"global", iec::Variable::Section::global},
                                                {"other", iec::Variable::Section::other}}};
constexpr std::array kKinds = {"program"sv, "function_block"sv, "function"sv};  // in the order of Pou::Kind
static_assert(std::to_underlying(iec::Pou::Kind::function) == 2);

class Reader {
 public:
  explicit Reader(std::span<const std::string> sources) : sources_(sources) {}

  ReadPlan read(const json& root) {
    const Value plan(root, "");
    plan.with(
        {"format", "problems", "remarks", "files", "pous", "types", "symbols", "hidden", "configurations"});
    (void)plan["format"].number(1, 1);
    plan["problems"].each([&](const Value& one) { read_.problems.push_back(problem(one)); });
    plan["remarks"].each([&](const Value& one) { read_.remarks.push_back(problem(one)); });
    plan["files"].each([&](const Value& one) { read_.files.push_back(file(one)); });
    plan["pous"].each([&](const Value& one) { read_.project.add(pou(one)); });
    plan["types"].each([&](const Value& one) {
      one.with({"name", "definition", "place"});
      read_.project.types.push_back({.name = one["name"].name(),
                                     .definition = iec::folded(one["definition"].text()),
                                     .place = place(one["place"])});
    });
    plan["symbols"].each([&](const Value& one) { read_.symbols.push_back(symbol(one)); });
    plan["hidden"].each([&](const Value& one) {
      one.with({"name", "why"});
      read_.symbols.push_back({.name = path(one["name"]),
                               .type = "",
                               .value = "",
                               .bounds = {},
                               .hidden = one["why"].text(kMostName)});
      if (read_.symbols.back().hidden.empty()) one["why"].refuse("a reason");
    });
    plan["configurations"].each(
        [&](const Value& one) { read_.project.configurations.push_back(configuration(one)); });
    return std::move(read_);
  }

 private:
  // [number of the source, line, column]; -1: the place is not known.
  iec::SourcePlace place(const Value& value) const {
    std::vector<std::int64_t> numbers;
    value.each([&](const Value& one) {
      constexpr std::int64_t kMostLine = 0x7fffffff;
      const bool is_file = numbers.empty();
      numbers.push_back(one.number(is_file ? -1 : 0, is_file ? std::ssize(sources_) - 1 : kMostLine));
    });
    if (numbers.size() != 3) value.refuse("three numbers");
    if (numbers[0] < 0) return {};
    return {sources_[static_cast<std::size_t>(numbers[0])], static_cast<unsigned>(numbers[1]),
            static_cast<unsigned>(numbers[2])};
  }
  iec::SourceProblem problem(const Value& value) const {
    value.with({"place", "text"});
    return {place(value["place"]), value["text"].text()};
  }
  static std::string file(const Value& value) {
    std::string name = value.text_of(std::string(kLetters) + ".", "a name of a file *.cpp in this folder");
    if (!name.ends_with(".cpp") || name.starts_with("."))
      value.refuse("a name of a file *.cpp in this folder");
    return name;
  }

  static PlannedSymbol symbol(const Value& value) {
    value.with({"name", "type", "value", "bounds"});
    PlannedSymbol symbol{.name = path(value["name"]),
                         .type = value["type"].name(),
                         .value = path(value["value"]),
                         .bounds = {},
                         .hidden = {}};
    value["bounds"].each([&](const Value& one) {
      std::vector<int> numbers;
      one.each([&](const Value& number) {
        numbers.push_back(static_cast<int>(number.number(-kMostIndex, kMostIndex)));
      });
      if (numbers.size() != 2 || numbers[0] > numbers[1]) one.refuse("two numbers, the first the smaller");
      symbol.bounds.push_back({.first = numbers[0], .last = numbers[1]});
    });
    for (const std::string& text : {symbol.name, symbol.value}) {
      if (static_cast<std::size_t>(std::ranges::count(text, '[')) != symbol.bounds.size())
        value["bounds"].refuse("two numbers for each []");
    }
    return symbol;
  }
  /// Names with dots between them, and "[]" behind them.
  static std::string path(const Value& value) {
    constexpr std::string_view kAllowed = "names with dots between them and [] behind them";
    std::string text = value.text_of(std::string(kLetters) + ".[]", kAllowed, kMostText);
    char before = '.';
    for (const char c : text) {
      const bool follows = c == '.'   ? before != '.' && before != '['
                           : c == '[' ? before != '.' && before != '['
                           : c == ']' ? before == '['
                                      : before != ']' && before != '[';
      if (!follows) value.refuse(kAllowed);
      before = c;
    }
    if (before == '.' || before == '[') value.refuse(kAllowed);
    return text;
  }

  iec::Pou pou(const Value& value) const {
    value.with({"kind", "name", "place", "variables"});
    const std::string kind = value["kind"].text();
    const auto* const known = std::ranges::find(kKinds, kind);
    if (known == kKinds.end()) value["kind"].refuse("program, function_block or function");
    iec::Pou pou{.kind = static_cast<iec::Pou::Kind>(known - kKinds.begin()),
                 .name = value["name"].name(),
                 .variables = {},
                 .chart = "",
                 .place = place(value["place"])};
    value["variables"].each([&](const Value& one) { pou.variables.push_back(variable(one)); });
    return pou;
  }
  iec::Variable variable(const Value& value) const {
    value.with({"name", "type", "location", "section", "retain", "constant", "place", "member"});
    const std::string section = value["section"].text();
    const auto* const known = std::ranges::find(kSections, section, &SectionWord::word);
    if (known == kSections.end()) value["section"].refuse("a section of variables");
    iec::Variable variable{
        .name = value["name"].text_of(std::string(kLetters) + ".", "a name of letters, digits, _ and ."),
        .type = value["type"].text(kMostName),
        .location = value["location"].text_of(std::string(kLetters) + "%.*", "a location like %IX0.0"),
        .section = known->section,
        .retain = value["retain"].truth(),
        .constant = value["constant"].truth(),
        .place = place(value["place"]),
        .member = value["member"].text_of(std::string(kLetters) + ".[](), -", "a member in C++")};
    if (variable.name.empty()) value["name"].refuse("a name");
    return variable;
  }

  iec::Configuration configuration(const Value& value) {
    value.with({"name", "place", "globals", "resources"});
    iec::Configuration configuration{
        .name = value["name"].name(), .globals = {}, .resources = {}, .place = place(value["place"])};
    value["globals"].each([&](const Value& one) { configuration.globals.push_back(variable(one)); });
    value["resources"].each([&](const Value& one) { configuration.resources.push_back(resource(one)); });
    return configuration;
  }
  iec::Resource resource(const Value& value) {
    value.with({"name", "place", "tasks", "programs"});
    iec::Resource resource{.name = value["name"].name(),
                           .globals = {},
                           .tasks = {},
                           .programs = {},
                           .place = place(value["place"])};
    std::set<std::string> names;
    value["tasks"].each([&](const Value& one) {
      resource.tasks.push_back(task(one));
      const iec::Task& added = resource.tasks.back();
      if (!names.insert(iec::folded(added.name)).second)
        report(added.place, fmt::format("there are two TASKs '{}'", added.name));
    });
    value["programs"].each([&](const Value& one) {
      one.with({"name", "type", "task", "place"});
      resource.programs.push_back({.name = one["name"].name(),
                                   .type = one["type"].name(),
                                   .task = one["task"].text_of(kLetters, "the name of a task"),
                                   .place = place(one["place"])});
      const iec::Program& added = resource.programs.back();
      if (!added.task.empty() && !names.contains(iec::folded(added.task))) {
        report(added.place,
               fmt::format("PROGRAM {} runs WITH '{}', and there is no such TASK in its resource", added.name,
                           added.task));
      }
    });
    return resource;
  }
  iec::Task task(const Value& value) {
    value.with({"name", "interval", "single", "priority", "place"});
    iec::Task task{.name = value["name"].name(),
                   .interval_ns = std::nullopt,
                   .single = value["single"].text_of(std::string(kLetters) + ".", "the name of a variable"),
                   .place = place(value["place"])};
    if (const std::string interval = value["interval"].text(kMostName); !interval.empty()) {
      const auto ns = iec::nanoseconds_of(interval);
      if (!ns) report(task.place, fmt::format("INTERVAL {}", ns.error()));
      if (ns && *ns < 0) report(task.place, fmt::format("INTERVAL {} is below 0", interval));
      if (ns && *ns > 0) task.interval_ns = *ns;
    }
    const std::string priority = value["priority"].text(kMostName);
    const char* const end = priority.data() + priority.size();
    if (priority.empty()) {
      report(task.place, fmt::format("TASK {} has no PRIORITY; 0 to 31 is allowed", task.name));
    } else if (std::from_chars(priority.data(), end, task.priority).ptr != end || task.priority < 0 ||
               task.priority > kMostPriority) {
      report(task.place, fmt::format("PRIORITY {}: allowed is 0 (the highest) to 31", priority));
      task.priority = 0;
    }
    return task;
  }
  void report(const iec::SourcePlace& place, std::string text) {
    read_.problems.push_back({place, std::move(text)});
  }

  std::span<const std::string> sources_;
  ReadPlan read_;
};

}  // namespace

Result<ReadPlan> read_plan(std::string_view text, std::span<const std::string> sources) {
  // A value is shown in a message by a function that calls itself for each list in a list.
  const auto shallow = [](int depth, json::parse_event_t /*event*/, json& /*value*/) {
    if (depth > kMostDepth)
      throw WrongPlan(fmt::format("more than {} lists and objects lie within each other", kMostDepth));
    return true;
  };
  try {
    const json root = json::parse(text, shallow, /*allow_exceptions=*/false);
    if (root.is_discarded()) return failure(ErrorCode::invalid_argument, "plan.json is no JSON");
    return Reader(sources).read(root);
  } catch (const WrongPlan& wrong) {
    return failure(ErrorCode::invalid_argument, fmt::format("plan.json: {}", wrong.what()));
  } catch (const json::exception& wrong) {
    return failure(ErrorCode::invalid_argument, fmt::format("plan.json: {}", wrong.what()));
  }
}

}  // namespace plchost::strucpp
