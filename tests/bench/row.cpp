#include "tests/bench/row.hpp"

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <limits>
#include <string_view>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <sys/utsname.h>
#include <unistd.h>

namespace plchost::bench {

namespace {

using nlohmann::ordered_json;

std::string processor() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);) {
    const auto colon = line.find(": ");
    if (line.starts_with("model name") && colon != std::string::npos) return line.substr(colon + 2);
  }
  return "unknown";
}

/// Of the sources, as run.sh says.
std::string revision() {
  const char* const said = std::getenv("PLCHOST_REVISION");
  return said != nullptr && *said != '\0' ? said : "unknown";
}

ordered_json machine() {
  utsname name{};
  ::uname(&name);
  return {{"kernel", fmt::format("{} {}", static_cast<const char*>(name.release),
                                 static_cast<const char*>(name.version))},
          {"processor", processor()},
          {"cores", ::sysconf(_SC_NPROCESSORS_ONLN)}};
}

/// Four digits say all that such a figure is worth; null if it is none.
ordered_json figure(double value) {
  if (std::isnan(value)) return nullptr;
  return ordered_json::parse(fmt::format("{:.4g}", value));
}

template <class Range, class Get>
ordered_json figures(const Range& range, Get get) {
  ordered_json array = ordered_json::array();
  for (const auto& one : range) array.push_back(figure(get(one)));
  return array;
}

/// Of what is a number.
double median_of(std::vector<double> values) {
  std::erase_if(values, [](double value) { return std::isnan(value); });
  if (values.empty()) return kNotMeasured;
  std::ranges::sort(values);
  const std::size_t half = values.size() / 2;
  return values.size() % 2 == 1 ? values[half] : (values[half - 1] + values[half]) / 2;
}

/// A row that was measured once is one round.
std::vector<Round> rounds_of(const Row& row) {
  if (!row.rounds.empty()) return row.rounds;
  return {{summarise(row.ours), summarise(row.floor), row.extra, row.targets}};
}

double value_of(const Extra& extra, std::string_view key) {
  const auto found = std::ranges::find(extra, key, &Extra::value_type::first);
  return found != extra.end() ? found->second : kNotMeasured;
}

/// A percentile, and the names of what is said about it.
struct Percentile {
  double Summary::* value;
  const char* name;
};
constexpr Percentile kPercentiles[] = {{&Summary::p50, "p50"},  // NOLINT(modernize-avoid-c-arrays)
                                       {&Summary::p90, "p90"},
                                       {&Summary::p99, "p99"},
                                       {&Summary::p999, "p999"},
                                       {&Summary::max, "max"}};

void put_percentiles(ordered_json& object, const Row& row, const std::vector<Round>& rounds) {
  const Summary ours = summarise(row.ours);
  const Summary floor = summarise(row.floor);
  for (const auto& [value, name] : kPercentiles) object[fmt::format("{}_us", name)] = figure(ours.*value);
  for (const auto& [value, name] : kPercentiles) {
    object[fmt::format("floor_{}_us", name)] = figure(floor.*value);
  }
  for (const auto& [value, name] : kPercentiles) {
    if (value == &Summary::max) continue;
    object[fmt::format("ratio_{}", name)] = figure(ratio_of_times(ours.*value, floor.*value));
  }
  object["samples"] = row.ours.size();
  object["floor_samples"] = row.floor.size();
  object["dropped_samples"] = row.ours.dropped();
  object["floor_dropped_samples"] = row.floor.dropped();
  object["rounds"] = rounds.size();
  for (const auto& [value, name] : kPercentiles) {
    if (value == &Summary::p90 || value == &Summary::max) continue;
    object[fmt::format("{}_us_rounds", name)] =
        figures(rounds, [&](const Round& round) { return round.ours.*value; });
    object[fmt::format("ratio_{}_rounds", name)] = figures(
        rounds, [&](const Round& round) { return ratio_of_times(round.ours.*value, round.floor.*value); });
  }
}

ordered_json to_object(const Row& row) {
  const std::vector<Round> rounds = rounds_of(row);
  ordered_json object{{"name", row.name}, {"condition", row.condition}, {"sample", row.sample}};
  put_percentiles(object, row, rounds);
  for (const auto& [key, value] : row.extra) {
    object["extra"][key] = figure(value);
    object["extra_rounds"][key] =
        figures(rounds, [&](const Round& round) { return value_of(round.extra, key); });
  }
  for (std::size_t i = 0; i < row.targets.size(); ++i) {
    const Verdict verdict = verdict_of(row, i);
    object["targets"].push_back(
        {{"target", row.targets[i].text},
         {"unit", row.targets[i].unit},
         {"measured", figure(row.targets[i].measured)},
         {"bound", figure(row.targets[i].bound)},
         {"measured_rounds", figures(rounds, [&](const Round& round) { return round.targets[i].measured; })},
         {"bound_rounds", figures(rounds, [&](const Round& round) { return round.targets[i].bound; })},
         {"verdict", verdict.text()}});
  }
  if (!row.note.empty()) object["note"] = row.note;
  object["conditions"] = machine();
  object["conditions"]["revision"] = revision();
  for (const auto& [key, value] : row.conditions) object["conditions"][key].push_back(figure(value));
  return object;
}

std::string text_of(double value, int width, int digits) {
  if (std::isnan(value)) return fmt::format("{:>{}}", "-", width);
  return fmt::format("{:>{}.{}f}", value, width, digits);
}

/// "0.95..1.02": the least and the most of all rounds.
std::string spread(const std::vector<double>& values, int digits) {
  std::vector<double> known;
  std::ranges::copy_if(values, std::back_inserter(known), [](double value) { return !std::isnan(value); });
  if (known.empty()) return "-";
  const auto [least, most] = std::ranges::minmax(known);
  if (known.size() == 1) return fmt::format("{:.{}f}", least, digits);
  return fmt::format("{:.{}f}..{:.{}f}", least, digits, most, digits);
}

std::string details(const Row& row) {
  if (row.extra.empty() && row.targets.empty() && row.note.empty()) return {};
  const std::vector<Round> rounds = rounds_of(row);
  const auto of_all = [&](auto get) {
    std::vector<double> values;
    std::ranges::transform(rounds, std::back_inserter(values), get);
    return values;
  };
  std::string text = fmt::format("\n{} ({}; a sample is {})\n", row.name, row.condition,
                                 row.sample.empty() ? "not said" : row.sample);
  for (const auto& [key, value] : row.extra) {
    text += fmt::format("    {:<36} {}  ({})\n", key, text_of(value, 14, 3),
                        spread(of_all([&](const Round& round) { return value_of(round.extra, key); }), 3));
  }
  for (std::size_t i = 0; i < row.targets.size(); ++i) {
    const Target& target = row.targets[i];
    text += fmt::format("  {}: {}: {} {} ({}), bound {}\n", verdict_of(row, i).text(), target.text,
                        text_of(target.measured, 0, 3), target.unit,
                        spread(of_all([&](const Round& round) { return round.targets[i].measured; }), 3),
                        text_of(target.bound, 0, 3));
  }
  if (!row.note.empty()) text += fmt::format("  note: {}\n", row.note);
  return text;
}

/// The least and the most of a figure of a target, of the rounds that decide it.
std::pair<double, double> range_of(const std::vector<Round>& rounds, std::size_t index,
                                   double Target::* figure) {
  double least = std::numeric_limits<double>::infinity();
  double most = -least;
  for (const Round& round : rounds) {
    const Target& target = round.targets[index];
    if (!target.decided()) continue;
    least = std::min(least, target.*figure);
    most = std::max(most, target.*figure);
  }
  return {least, most};
}

/// The rounds' bounds lie so far apart that they show the machine, of whose floor they are made.
bool bound_moves(const std::vector<Round>& rounds, std::size_t index) {
  constexpr double kApart = 1.5;
  const auto [least, most] = range_of(rounds, index, &Target::bound);
  return most > kApart * least;
}

/// The bound is one figure, the same in each round.
bool steady(const std::vector<Round>& rounds, std::size_t index) {
  const auto [least, most] = range_of(rounds, index, &Target::measured);
  return most - least <= rounds.front().targets[index].bound;  // also if there is none
}

void add_figures(Row& row, Row round) {
  row.rounds.push_back({summarise(round.ours), summarise(round.floor), round.extra, round.targets});
  row.ours.append(round.ours);
  row.floor.append(round.floor);
  std::ranges::move(round.conditions, std::back_inserter(row.conditions));
  if (row.note.empty()) row.note = std::move(round.note);
}

/// The figures of all rounds together.
void take_medians(Row& row) {
  const auto over = [&](auto get) {
    std::vector<double> values;
    std::ranges::transform(row.rounds, std::back_inserter(values), get);
    return median_of(std::move(values));
  };
  for (auto& [key, value] : row.extra)
    value = over([&](const Round& round) { return value_of(round.extra, key); });
  // A figure and its bound belong together: of the rounds that have both.
  for (std::size_t i = 0; i < row.targets.size(); ++i) {
    const auto if_decided = [i](const Round& round, double Target::* figure) {
      return round.targets[i].decided() ? round.targets[i].*figure : kNotMeasured;
    };
    row.targets[i].measured = over([&](const Round& round) { return if_decided(round, &Target::measured); });
    row.targets[i].bound = over([&](const Round& round) { return if_decided(round, &Target::bound); });
  }
}

}  // namespace

Target lost_cycles_target(std::string_view floor_text, double lost, double floor) {
  constexpr double kNoise = 1000;
  return {.text = fmt::format("lost cycles at most twice those of {}, and 100 in a million", floor_text),
          .unit = "per million",
          .measured = lost,
          .bound = floor <= kNoise ? 2 * floor + 100 : kNotMeasured,
          .or_equal = true};
}

void add_round(std::vector<Row>& all, std::vector<Row> round) {
  for (Row& one : round) {
    auto row = std::ranges::find_if(
        all, [&](const Row& known) { return known.name == one.name && known.condition == one.condition; });
    // A part that finds another machine than before (a tool that was removed) gives rows with other targets.
    const bool same = row != all.end() && row->targets.size() == one.targets.size();
    if (!same) {
      row = all.insert(all.end(), Row{.name = one.name,
                                      .sample = one.sample,
                                      .condition = one.condition,
                                      .extra = one.extra,
                                      .targets = one.targets,
                                      .series = std::move(one.series)});
    }
    add_figures(*row, std::move(one));
    take_medians(*row);
  }
}

Verdict verdict_of(const Row& row, std::size_t index) {
  Verdict verdict;
  const std::vector<Round> rounds = rounds_of(row);
  if (rounds.front().targets[index].only_steady && !steady(rounds, index)) return verdict;
  for (const Round& round : rounds) {
    if (round.targets[index].decided()) ++verdict.decided;
    if (round.targets[index].met()) ++verdict.met;
  }
  const bool agreed = verdict.met == 0 || verdict.met == verdict.decided;
  if (!agreed && bound_moves(rounds, index)) return {};
  return verdict;
}

std::string Verdict::text() const {
  if (decided == 0) return "not measured";
  if (met == decided) return "met";
  if (met == 0) return "not met";
  return fmt::format("met in {} of {} rounds", met, decided);
}

std::string to_json(const std::vector<Row>& rows) {
  std::string text = "[";  // a line for each row
  for (const Row& row : rows) {
    text += text == "[" ? "\n" : ",\n";
    text += to_object(row).dump();
  }
  return text + "\n]\n";
}

std::string to_table(const std::vector<Row>& rows) {
  std::string text = fmt::format(
      "{:<34} {:<6} {:>9} {:>9} {:>9} {:>9} {:>9} {:>9} {:>8} {:>8}  {:<12} {:<12} {}\n", "times in us", "",
      "p50", "p99", "p99.9", "floor p50", "p99", "p99.9", "samples", "of floor", "ratio p50", "p99", "p99.9");
  std::string below;
  for (const Row& row : rows) {
    const Summary ours = summarise(row.ours);
    const Summary floor = summarise(row.floor);
    const std::vector<Round> rounds = rounds_of(row);
    const auto ratios = [&](double Summary::* value) {
      std::vector<double> all;
      for (const Round& round : rounds) all.push_back(ratio_of_times(round.ours.*value, round.floor.*value));
      return spread(all, 2);
    };
    text += fmt::format("{:<34} {:<6} {} {} {} {} {} {} {:>8} {:>8}  {:<12} {:<12} {}\n", row.name,
                        row.condition, text_of(ours.p50, 9, 2), text_of(ours.p99, 9, 2),
                        text_of(ours.p999, 9, 2), text_of(floor.p50, 9, 2), text_of(floor.p99, 9, 2),
                        text_of(floor.p999, 9, 2), row.ours.size(), row.floor.size(), ratios(&Summary::p50),
                        ratios(&Summary::p99), ratios(&Summary::p999));
    below += details(row);
  }
  return text + below;
}

}  // namespace plchost::bench
