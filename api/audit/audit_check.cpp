#include "api/audit/audit_check.hpp"

#include <fstream>
#include <optional>

#include <fmt/format.h>

#include "api/audit/audit_file.hpp"

namespace plchost {

namespace {

/// The state between two lines.
class Walk {
 public:
  explicit Walk(AuditFindings& findings) : findings_(findings) {}

  void take(const std::string& where, const std::string& line) {
    const auto link = read_link(line);
    if (!link) {
      settle();
      unsettled_ = fmt::format("{}: {}", where, link.error().message);
      return;
    }
    // A process that was killed while it wrote leaves half a line; the next one says so and goes on.
    if (unsettled_ && link->what == "repair") {
      findings_.remarks.push_back(fmt::format("{}: a record before was not completed", where));
      unsettled_.reset();
    }
    settle();
    if (link->what == "gap")
      findings_.remarks.push_back(fmt::format("{}: records could not be written", where));
    compare(where, *link);
    findings_.head = {.number = link->number, .hash = link->hash};
    ++findings_.records;
  }

  void settle() {
    if (unsettled_) problem(*unsettled_);
    unsettled_.reset();
  }

 private:
  void compare(const std::string& where, const AuditLink& link) {
    if (findings_.records == 0) {
      findings_.first = link.number;
      const bool whole = link.number != 1 || link.before == AuditHead().hash;
      if (!whole) problem(fmt::format("{}: record 1 follows another one", where));
    } else if (link.number != findings_.head.number + 1) {
      problem(fmt::format("{}: record {} follows record {}", where, link.number, findings_.head.number));
    } else if (link.before != findings_.head.hash) {
      problem(fmt::format("{}: record {} does not follow this record {}", where, link.number,
                          findings_.head.number));
    }
  }

  void problem(const std::string& text) {
    if (findings_.problems.size() < AuditFindings::kMostProblems) findings_.problems.push_back(text);
  }

  AuditFindings& findings_;
  std::optional<std::string> unsettled_;  // a problem, unless the next record explains it
};

}  // namespace

Result<AuditFindings> check_audit(const std::string& folder) {
  const auto files = audit_files(folder);
  if (!files) return std::unexpected(files.error());
  if (files->empty()) return failure(ErrorCode::not_found, fmt::format("{} has no audit.*.log", folder));
  AuditFindings findings;
  Walk walk(findings);
  for (const AuditFile& file : *files) {
    std::ifstream lines(file.path);
    if (!lines) return failure(ErrorCode::system, "open " + file.path, errno);
    std::size_t number = 0;
    for (std::string line; std::getline(lines, line);)
      walk.take(fmt::format("{}:{}", file.path, ++number), line);
    if (lines.bad()) return failure(ErrorCode::system, "read " + file.path, errno);
  }
  walk.settle();
  return findings;
}

}  // namespace plchost
