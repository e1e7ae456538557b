#include "tests/bench/row.hpp"

#include <fstream>

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

ordered_json machine() {
  utsname name{};
  ::uname(&name);
  return {{"kernel", fmt::format("{} {}", static_cast<const char*>(name.release),
                                 static_cast<const char*>(name.version))},
          {"processor", processor()},
          {"cores", ::sysconf(_SC_NPROCESSORS_ONLN)}};
}

void put(ordered_json& into, const std::string& prefix, const Summary& summary) {
  into[prefix + "p50_us"] = summary.p50;
  into[prefix + "p90_us"] = summary.p90;
  into[prefix + "p99_us"] = summary.p99;
  into[prefix + "p999_us"] = summary.p999;
  into[prefix + "max_us"] = summary.max;
}

ordered_json to_object(const Row& row) {
  const Summary ours = summarise(row.ours);
  const Summary floor = summarise(row.floor);
  ordered_json object{{"name", row.name}, {"condition", row.condition}};
  put(object, "", ours);
  put(object, "floor_", floor);
  object["ratio_p50"] = ratio(ours.p50, floor.p50);
  object["ratio_p99"] = ratio(ours.p99, floor.p99);
  object["ratio_p999"] = ratio(ours.p999, floor.p999);
  object["samples"] = row.ours.size();
  object["floor_samples"] = row.floor.size();
  for (const auto& [key, value] : row.extra) object["extra"][key] = value;
  bool met = true;
  for (const Target& target : row.targets) {
    object["targets"].push_back({{"target", target.text},
                                 {"measured", target.measured},
                                 {"bound", target.bound},
                                 {"met", target.met()}});
    met = met && target.met();
  }
  if (!row.targets.empty()) object["met"] = met;
  if (!row.note.empty()) object["note"] = row.note;
  return object;
}

std::string details(const Row& row) {
  if (row.extra.empty() && row.targets.empty() && row.note.empty()) return {};
  std::string text = fmt::format("\n{} ({})\n", row.name, row.condition);
  for (const auto& [key, value] : row.extra) text += fmt::format("    {:<36} {:>14.3f}\n", key, value);
  for (const Target& target : row.targets) {
    text += fmt::format("  {} {}: {:.3f}, bound {:.3f}\n", target.met() ? "met    " : "NOT MET", target.text,
                        target.measured, target.bound);
  }
  if (!row.note.empty()) text += fmt::format("  note: {}\n", row.note);
  return text;
}

}  // namespace

std::string to_json(const std::vector<Row>& rows) {
  ordered_json array = ordered_json::array();
  for (const Row& row : rows) array.push_back(to_object(row));
  return ordered_json{{"machine", machine()}, {"rows", array}}.dump(2) + "\n";
}

std::string to_markdown(const std::vector<Row>& rows) {
  std::string text =
      "| | | p50 µs | p99 | p99.9 | floor p50 | p99 | p99.9 | ratio p50 | p99 | p99.9 |\n"
      "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n";
  std::string verdicts = "\n| | | to show | measured | bound | |\n| --- | --- | --- | --- | --- | --- |\n";
  for (const Row& row : rows) {
    const Summary ours = summarise(row.ours);
    const Summary floor = summarise(row.floor);
    text += fmt::format(
        "| `{}` | {} | {:.2f} | {:.1f} | {:.1f} | {:.2f} | {:.1f} | {:.1f} | {:.2f} | {:.2f} | {:.2f} |\n",
        row.name, row.condition, ours.p50, ours.p99, ours.p999, floor.p50, floor.p99, floor.p999,
        ratio(ours.p50, floor.p50), ratio(ours.p99, floor.p99), ratio(ours.p999, floor.p999));
    for (const Target& target : row.targets) {
      verdicts +=
          fmt::format("| `{}` | {} | {} | {:.3g} | {:.3g} | {} |\n", row.name, row.condition, target.text,
                      target.measured, target.bound, target.met() ? "met" : "**not met**");
    }
  }
  return text + verdicts;
}

std::string to_table(const std::vector<Row>& rows) {
  std::string text = fmt::format("{:<34} {:<6} {:>9} {:>9} {:>10} {:>10} {:>10} {:>7} {:>7} {:>7} {:>8}\n",
                                 "name", "", "p50 us", "p99 us", "p99.9 us", "floor p50", "floor p99",
                                 "x p50", "x p99", "x p99.9", "samples");
  std::string below;
  for (const Row& row : rows) {
    const Summary ours = summarise(row.ours);
    const Summary floor = summarise(row.floor);
    text += fmt::format(
        "{:<34} {:<6} {:>9.2f} {:>9.2f} {:>10.2f} {:>10.2f} {:>10.2f} {:>7.2f} {:>7.2f} {:>7.2f} {:>8}\n",
        row.name, row.condition, ours.p50, ours.p99, ours.p999, floor.p50, floor.p99,
        ratio(ours.p50, floor.p50), ratio(ours.p99, floor.p99), ratio(ours.p999, floor.p999),
        row.ours.size());
    below += details(row);
  }
  return text + below;
}

}  // namespace plchost::bench
