#include <ctime>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "api/cli/cli_session.hpp"
#include "api/cli/own_file.hpp"
#include "api/cli/rows/host_rows.hpp"
#include "api/cli/rows/log_rows.hpp"
#include "api/cli/rows/rows.hpp"
#include "api/cli/rows/statistics_rows.hpp"
#include "api/cli/rows/status_rows.hpp"
#include "api/cli/verbs/audit_tail.hpp"
#include "api/cli/verbs/transition_verbs.hpp"
#include "api/client/client_core_status.hpp"
#include "api/client/log_reader.hpp"
#include "api/dds/text.hpp"
#include "shm/base/names.hpp"

namespace plchost {

namespace {

constexpr std::size_t kMostRecords = 200;  // of the audit log

/// All that a host tells of one instance, for a supporter without access to the host. It comes from status
/// topics and the log. None of them has a key, a password or a setting that may be
/// one. The audit log comes from this machine, if the user asks for it and may read it.
class Report {
 public:
  /// `audit`: folder of the audit log; empty: without.
  Report(CliSession& session, std::string host, std::string instance, std::string audit)
      : session_(session), host_(std::move(host)), instance_(std::move(instance)), audit_(std::move(audit)) {}

  /// Nothing is written of a host that does not answer, or of an instance that it does not have.
  Result<Row> make(const std::string& version) {
    PLCHOST_TRY_ASSIGN(client_, session_.client());
    PLCHOST_TRY_ASSIGN(const auto host, client_->host(host_, session_.deadline()));
    PLCHOST_TRY(session_.check_instance(instance_));
    report_["report"] = 1;
    const std::int64_t now = std::int64_t{std::time(nullptr)} * 1'000'000'000;
    report_["made"] = time_text(now);
    report_["plcctl"] = version;
    report_["host"] = to_row(host, std::nullopt);
    add("findings", findings());
    add("instance", rows_of<plc_InstanceStatus>());
    add("applications", rows_of<plc_ApplicationStatus>(false));
    add("exception", rows_of<plc_ExceptionStatus>());
    add("losses", rows_of<plc_LossStatus>());
    add("tasks", tasks());
    add("events", rows_of<plc_EventStatus>());
    add("transitions", transition_rows(session_, instance_));
    add("log", log());
    if (!audit_.empty()) add("audit", audit_tail(audit_, instance_, kMostRecords));
    report_["missing"] = std::move(missing_);
    return std::move(report_);
  }
  /// "log: the role operator is needed", of each part that is missing.
  [[nodiscard]] const std::vector<std::string>& parts_missing() const noexcept { return parts_missing_; }

 private:
  using Rows = Result<std::vector<Row>>;

  // A part that the host does not give, as the log to a viewer, is named with the reason.
  void add(const char* part, Rows rows) {
    if (rows) {
      report_[part] = *std::move(rows);
      return;
    }
    parts_missing_.push_back(fmt::format("{}: {}", part, rows.error().describe()));
    missing_.push_back(parts_missing_.back());
  }

  template <class Sample, class... Context>
  Rows rows_of(const Context&... context) {
    PLCHOST_TRY_ASSIGN(const auto samples, client_->status<Sample>(host_, session_.deadline()));
    std::vector<Row> rows;
    for (const Sample& sample : samples) {
      if (dds::text_of(sample.instance) == instance_) rows.push_back(to_row(sample, context...));
    }
    return rows;
  }

  Rows findings() {
    PLCHOST_TRY_ASSIGN(const auto found, client_->check_host(host_, session_.deadline()));
    std::vector<Row> rows;
    for (const plc_HostFinding& finding : found) rows.push_back(to_row(finding));
    return rows;
  }

  Rows tasks() {
    PLCHOST_TRY_ASSIGN(const auto samples, client_->tasks(host_, session_.deadline()));
    std::vector<Row> rows;
    for (const plc_TaskStatus& task : samples) {
      if (dds::text_of(task.instance) != instance_) continue;
      PLCHOST_TRY_ASSIGN(const auto figures,
                         client_->statistics(host_, instance_, dds::text_of(task.task), session_.deadline()));
      add_statistics(rows.emplace_back(to_row(task)), figures.sample());
    }
    return rows;
  }

  Rows log() {
    LogReader reader(host_, instance_);
    PLCHOST_TRY_ASSIGN(const auto lines, client_->wait(reader.read(client_->core(), session_.deadline())));
    std::vector<Row> rows;
    for (const LogText& line : lines) rows.push_back(to_row(host_, instance_, line));
    return rows;
  }

  CliSession& session_;
  std::string host_;
  std::string instance_;
  std::string audit_;
  ControlClient* client_ = nullptr;
  Row report_;
  Row missing_ = Row::array();
  std::vector<std::string> parts_missing_;
};

int save_report(CliSession& session, const std::string& instance, const std::string& file,
                const std::string& audit, const std::string& version) {
  auto own = OwnFile::create(file);
  if (!own) return CliSession::fail(own.error());
  auto host = session.target_host();
  if (!host) return CliSession::fail(host.error());
  Report report(session, *std::move(host), instance, audit);
  const auto made = report.make(version);
  if (!made) return CliSession::fail(made.error());
  const std::string text = made->dump(2, ' ', true, Row::error_handler_t::replace) + "\n";
  auto written = own->write(text);
  if (written) written = own->put_in_place();
  if (!written) return CliSession::fail(written.error());
  for (const std::string& part : report.parts_missing()) {
    session.say(printable(fmt::format("{} has not all: {}", file, part)));
  }
  session.say(fmt::format("{} has the report of {}", shown(file), instance));
  return kExitDone;
}

}  // namespace

void add_save_verb(const Command& plcctl, CliSession& session, const std::string& version) {
  const auto instance = std::make_shared<std::string>();
  const auto file = std::make_shared<std::string>();
  const auto audit = std::make_shared<std::optional<std::string>>();
  plcctl.verb("save", "Write all that is known of an instance into a file")
      .noun("report",
            "Write what a supporter needs of an instance: versions, check of the host, tasks, exception, log",
            [&session, instance, file, audit, version] {
              return save_report(session, *instance, *file, audit->value_or(""), version);
            })
      .argument("INSTANCE", *instance)
      .argument("FILE", *file, "JSON; only its owner may read it")
      .option("--audit", *audit, "Also the last 200 records of the audit log in this folder of this machine");
}

}  // namespace plchost
