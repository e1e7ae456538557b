#include <algorithm>
#include <array>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include "api/cli/cli_session.hpp"
#include "api/cli/plant/plant_file.hpp"
#include "api/cli/plant/plant_work.hpp"
#include "shm/base/names.hpp"
#include "shm/operations/operations.hpp"

namespace plchost {

namespace {

/// Exit codes of `diff`, as those of diff(1).
constexpr int kDiffers = 1;
constexpr int kDiffFailed = 2;

using Kind = PlantFinding::Result;

std::string_view result_name(Kind result) {
  constexpr std::array<std::string_view, 6> kNames = {"differs",   "done",    "failed",
                                                      "no answer", "unknown", "refused"};
  return kNames.at(static_cast<std::size_t>(result));
}

Row row_of(const PlantFinding& finding) {
  return {{"host", finding.host}, {"instance", finding.instance}, {"what", finding.what},
          {"is", finding.is},     {"wanted", finding.wanted},     {"result", result_name(finding.result)},
          {"line", finding.line}, {"remark", finding.remark}};
}

void tell(const PlantFinding& finding, const std::string& file) {
  const std::string where =
      finding.instance.empty() ? finding.host : fmt::format("{}/{}", finding.host, finding.instance);
  const bool wrong = finding.result != Kind::differs && finding.result != Kind::done;
  if (finding.what.empty()) {
    fmt::print(stderr, "plcctl: {}:{}: {}: {}\n", file, finding.line, where, printable(finding.remark));
    return;
  }
  const std::string change = fmt::format("{}: {}: {} -> {}", where, finding.what,
                                         finding.is.empty() ? "-" : printable(finding.is), finding.wanted);
  if (wrong) {
    fmt::print(stderr, "plcctl: {}:{}: {}: {}\n", file, finding.line, change, printable(finding.remark));
  } else if (finding.result == Kind::done) {
    fmt::print("{}: done{}{}\n", change, finding.remark.empty() ? "" : ", ", printable(finding.remark));
  } else {
    fmt::print("{}\n", change);
  }
}

bool has(const std::vector<PlantFinding>& findings, Kind result) {
  return std::ranges::find(findings, result, &PlantFinding::result) != findings.end();
}

int exit_code(const std::vector<PlantFinding>& findings, bool apply) {
  static_assert(kExitUsage == kDiffFailed);
  if (has(findings, Kind::refused)) return kExitUsage;
  const bool missing = has(findings, Kind::missing);
  if (!apply) {
    if (missing || has(findings, Kind::unknown)) return kDiffFailed;
    return findings.empty() ? kExitDone : kDiffers;
  }
  if (has(findings, Kind::failed) || has(findings, Kind::unknown)) return kExitFailed;
  return missing ? kExitNoAnswer : kExitDone;
}

int work(CliSession& session, const std::string& file, bool apply) {
  const auto plant = load_plant(file);
  if (!plant) {
    for (const std::string& error : plant.error()) fmt::print(stderr, "plcctl: {}\n", printable(error));
    return kExitUsage;
  }
  const auto client = session.client();
  if (!client) {
    const int code = CliSession::fail(client.error());
    return apply ? code : kDiffFailed;
  }
  const Duration patience = session.timeout();
  const auto findings = work_on(
      **client, *plant, session.options.hosts,
      {.apply = apply,
       .patience = patience,
       .command_patience = session.options.timeout_given ? patience : std::max(patience, kLongCommand)});
  if (session.options.json || session.options.csv) {
    std::vector<Row> rows;
    for (const PlantFinding& finding : findings) rows.push_back(row_of(finding));
    if (const int shown = session.show(rows, {}); shown != kExitDone) return shown;
  } else {
    for (const PlantFinding& finding : findings) tell(finding, plant->file);
    if (apply && findings.empty()) fmt::print("nothing to change\n");
  }
  return exit_code(findings, apply);
}

}  // namespace

void add_plant_verbs(const Command& plcctl, CliSession& session) {
  const auto file = std::make_shared<std::string>();
  const auto dry_run = std::make_shared<bool>(false);
  constexpr const char* kFile = "how the hosts are to be; '-': standard input";
  plcctl
      .noun(
          "diff",
          "Show what 'apply' would change; exit codes: 0 nothing, 1 something, 2 a host or file is not as it "
          "must be",
          [&session, file] { return work(session, *file, false); })
      .file("-f,--file", *file, kFile);
  plcctl
      .noun("apply",
            "Bring hosts to the state in a file: schedulers, applications, events, running or stopped",
            [&session, file, dry_run] { return work(session, *file, !*dry_run); })
      .file("-f,--file", *file, kFile)
      .flag("-n,--dry-run", *dry_run, "change nothing, the same as 'diff'");
}

}  // namespace plchost
