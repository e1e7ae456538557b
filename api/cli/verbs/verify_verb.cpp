#include <algorithm>
#include <memory>
#include <string>

#include <fmt/format.h>

#include "api/audit/audit_check.hpp"
#include "api/cli/cli_session.hpp"
#include "api/cli/rows/rows.hpp"
#include "shm/base/names.hpp"

namespace plchost {

namespace {

int verify_audit(const CliSession& session, const std::string& folder) {
  const auto findings = check_audit(folder);
  if (!findings) return CliSession::fail(findings.error());
  const int code = findings->problems.empty() ? kExitDone : kExitFailed;
  if (session.options.json || session.options.csv) {
    const int shown = session.show({{{"folder", folder},
                                     {"records", findings->records},
                                     {"first", findings->first},
                                     {"last", findings->head.number},
                                     {"hash", findings->head.hash},
                                     {"problems", fmt::format("{}", fmt::join(findings->problems, "; "))},
                                     {"remarks", fmt::format("{}", fmt::join(findings->remarks, "; "))}}},
                                   {});
    return std::max(code, shown);
  }
  for (const std::string& problem : findings->problems) fmt::print("problem  {}\n", printable(problem));
  for (const std::string& remark : findings->remarks) fmt::print("note     {}\n", printable(remark));
  if (findings->first > 1)
    fmt::print("note     the log begins at record {}: earlier files are gone\n", findings->first);
  fmt::print("{}  {}, {} to {}; the last one's hash is {}\n", code == kExitDone ? "ok     " : "problem",
             count_text(findings->records, "record"), findings->first, findings->head.number,
             findings->head.hash);
  return code;
}

}  // namespace

void add_verify_verb(const Command& plcctl, CliSession& session) {
  const auto folder = std::make_shared<std::string>();
  plcctl.verb("verify", "Check what must not have been changed")
      .noun("audit",
            "Whether the log of changes of a controller is whole; where it lies, on the controller itself",
            [&session, folder] { return verify_audit(session, *folder); })
      .argument("FOLDER", *folder, "STATE_DIRECTORY/audit.HOST");
}

}  // namespace plchost
