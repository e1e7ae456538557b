#include <algorithm>
#include <array>
#include <memory>
#include <vector>

#include <code_words.hpp>
#include <fmt/format.h>

#include "api/cli/cli_session.hpp"
#include "api/cli/rows/status_rows.hpp"
#include "api/dds/code_names.hpp"
#include "api/dds/field_info.hpp"
#include "api/dds/text.hpp"
#include "shm/base/names.hpp"

namespace plchost {

namespace {

using Words = dds::words::HostFinding;
constexpr std::uint32_t kOk = dds::code_for(Words::level, "ok");
constexpr std::uint32_t kNote = dds::code_for(Words::level, "note");
constexpr std::uint32_t kWarning = dds::code_for(Words::level, "warning");
constexpr std::uint32_t kProblem = dds::code_for(Words::level, "problem");

// The sentences of a finding are too long for the columns of a table.
void print(const plc_HostFinding& finding) {
  const auto text = [](const auto& member) { return printable(std::string(dds::text_of(member))); };
  fmt::print("{:<8} {:<19} {}: {}\n", dds::finding_level_name(finding.level), text(finding.id),
             text(finding.subject), text(finding.found));
  if (finding.level == kOk) return;
  if (const auto why = text(finding.why); !why.empty()) fmt::print("{:<8} why:    {}\n", "", why);
  if (const auto advice = text(finding.advice); !advice.empty()) fmt::print("{:<8} change: {}\n", "", advice);
}

void print_all(const std::vector<plc_HostFinding>& findings, bool all) {
  std::array<std::size_t, kProblem + 1> count{};
  for (const plc_HostFinding& finding : findings) {
    ++count.at(std::min<std::size_t>(finding.level, kProblem));
    if (all || finding.level != kOk) print(finding);
  }
  fmt::print("{}, {}, {}, {} ok{}\n", count_text(count[kProblem], "problem"),
             count_text(count[kWarning], "warning"), count_text(count[kNote], "note"), count[kOk],
             all || count[kOk] == 0 ? "" : " (--all shows them)");
}

int check_host(CliSession& session, bool all) {
  const auto host = session.target_host();
  if (!host) return CliSession::fail(host.error());
  auto findings = session.client().value()->check_host(*host, session.deadline());
  if (!findings) return CliSession::fail(findings.error());
  std::ranges::stable_sort(*findings, std::ranges::greater(), &plc_HostFinding::level);
  if (session.options.json || session.options.csv) {
    std::vector<Row> rows;
    for (const plc_HostFinding& finding : *findings) {
      if (all || finding.level != kOk) rows.push_back(to_row(finding));
    }
    if (const int shown = session.show(rows, {}); shown != kExitDone) return shown;
  } else {
    print_all(*findings, all);
  }
  const std::uint32_t worst = findings->empty() ? kOk : findings->front().level;
  if (worst >= kProblem) return kExitFailed;
  return worst == kWarning ? kExitWarnings : kExitDone;
}

}  // namespace

void add_check_verb(const Command& plcctl, CliSession& session) {
  const auto all = std::make_shared<bool>(false);
  plcctl.verb("check", "Look for obstacles to the real-time behaviour of a controller")
      .noun("host", "The changes that the controller needs, the worst first",
            [&session, all] { return check_host(session, *all); })
      .flag("--all", *all, "also the checks that found nothing to change");
}

}  // namespace plchost
