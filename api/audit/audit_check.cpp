#include "api/audit/audit_check.hpp"

#include <cerrno>
#include <fstream>

#include <fmt/format.h>

#include "api/audit/audit_file.hpp"

namespace plchost {

void AuditWalk::take(const std::string& where, std::string_view line) {
  const auto link = read_link(line);
  if (!link) {
    if (unexplained_.size() < AuditFindings::kMostProblems)
      unexplained_.push_back(fmt::format("{}: {}", where, link.error().message));
    return;
  }
  // A process that was killed while it wrote leaves half a line, and a power cut several; the next one says
  // so and goes on.
  if (!unexplained_.empty() && link->what == "repair") {
    findings_.remarks.push_back(fmt::format("{}: a record before was not completed", where));
    unexplained_.clear();
  }
  end();
  if (link->what == "gap") {
    findings_.remarks.push_back(
        fmt::format("{}: records before could not be written, or may be missing", where));
  }
  if (link->what == "disk") {
    findings_.remarks.push_back(fmt::format("{}: a disk error; records before were written again", where));
  }
  compare(where, *link);
  findings_.head = {.number = link->number, .hash = link->hash};
  ++findings_.records;
}

void AuditWalk::end() {
  for (const std::string& each : unexplained_) problem(each);
  unexplained_.clear();
}

void AuditWalk::compare(const std::string& where, const AuditLink& link) {
  if (findings_.records == 0) {
    findings_.first = link.number;
    const bool follows = link.number == 1 && link.before != AuditHead().hash;
    if (follows) problem(fmt::format("{}: record 1 follows another one", where));
  } else if (link.number != findings_.head.number + 1) {
    problem(fmt::format("{}: record {} follows record {}", where, link.number, findings_.head.number));
  } else if (link.before != findings_.head.hash) {
    problem(fmt::format("{}: record {} does not follow this record {}", where, link.number,
                        findings_.head.number));
  }
}

void AuditWalk::problem(const std::string& text) {
  if (findings_.problems.size() < AuditFindings::kMostProblems) findings_.problems.push_back(text);
}

Result<AuditFindings> check_audit(const std::string& folder) {
  PLCHOST_TRY_ASSIGN(const auto files, audit_files(folder));
  if (files.empty()) return failure(ErrorCode::not_found, fmt::format("{} has no audit.*.log", folder));
  AuditFindings findings;
  AuditWalk walk(findings);
  for (const AuditFile& file : files) {
    std::ifstream lines(file.path);
    if (!lines) return failure(ErrorCode::system, "cannot open " + file.path, errno);
    std::size_t number = 0;
    for (std::string line; std::getline(lines, line);)
      walk.take(fmt::format("{}:{}", file.path, ++number), line);
    if (lines.bad()) return failure(ErrorCode::system, "cannot read " + file.path, errno);
  }
  walk.end();
  return findings;
}

}  // namespace plchost
