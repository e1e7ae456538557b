#include <algorithm>
#include <array>
#include <cerrno>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <code_words.hpp>
#include <fmt/format.h>
#include <unistd.h>

#include "api/cli/cli_session.hpp"
#include "api/cli/own_folder.hpp"
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

struct CheckOrder {
  bool all = false;
  bool fix = false;
  bool apply = false;
  bool revert = false;
  std::string config;
  std::optional<std::string> root;
};

int wrong_use(std::string_view text) {
  fmt::print(stderr, "plcctl: {}\n", text);
  return kExitUsage;
}

// The plan is made, and its files are written, by the program that has the checks. It works before a manager
// runs, and none of this can be asked for over the network.
int fix_host(const CliOptions& options, const CheckOrder& order) {
  if (order.apply && order.revert) return wrong_use("--apply and --revert exclude each other");
  if (!options.hosts.host.empty() || !options.hosts.labels.empty())
    return wrong_use(
        "--fix is about this machine: run it on the controller, without --host, --label and PLCHOST_HOST");
  if (options.json || options.csv || order.all) return wrong_use("--fix prints text only, without --all");
  const std::string program = own_folder() / "plchostd";
  const char* const mode = order.apply ? "apply" : order.revert ? "revert" : "print";
  std::vector<const char*> words = {program.c_str(), "--fix-host", mode};
  if (!order.config.empty()) words.insert(words.end(), {"--config", order.config.c_str()});
  // Also an empty one: plchostd refuses it. Without it the order would be about this machine.
  if (order.root) words.insert(words.end(), {"--root", order.root->c_str()});
  words.push_back(nullptr);
  ::execv(program.c_str(), const_cast<char* const*>(words.data()));
  return CliSession::fail({ErrorCode::system, errno, "--fix works on a controller only: " + program});
}

int check(CliSession& session, const CheckOrder& order) {
  if (order.fix) return fix_host(session.options, order);
  if (order.apply || order.revert || !order.config.empty() || order.root)
    return wrong_use("--apply, --revert, --config and --root need --fix");
  return check_host(session, order.all);
}

}  // namespace

void add_check_verb(const Command& plcctl, CliSession& session) {
  const auto order = std::make_shared<CheckOrder>();
  plcctl.verb("check", "Look for obstacles to the real-time behaviour of a controller")
      .noun("host",
            "The changes that the controller needs, the worst first; with --fix the files that make them",
            [&session, order] { return check(session, *order); })
      .flag("--all", order->all, "also the checks that found nothing to change")
      .flag("--fix", order->fix,
            "on the controller itself: print the files in /etc that make the changes, from its configuration")
      .flag("--apply", order->apply, "with --fix: write these files, and run what they need (as root)")
      .flag("--revert", order->revert, "with --fix: remove these files (as root)")
      .option("--config", order->config,
              "with --fix: the configuration of the manager (else /etc/plchost/plchost.toml)", "")
      .option("--root", order->root, "with --fix: the folder of an image, where nothing is run");
}

}  // namespace plchost
