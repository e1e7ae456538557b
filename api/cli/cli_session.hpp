#pragma once

#include <chrono>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "api/cli/host_selection.hpp"
#include "api/cli/rows/table.hpp"
#include "api/cli/words/command.hpp"
#include "api/client/check_names.hpp"
#include "api/client/client_types.hpp"
#include "api/client/control_client.hpp"

namespace plchost {

/// Exit codes of plcctl.
inline constexpr int kExitDone = 0;
inline constexpr int kExitFailed = 1;  ///< refused or failed; `check` has found a problem
inline constexpr int kExitUsage = 2;
inline constexpr int kExitNoAnswer = 3;
inline constexpr int kExitWarnings = 4;  ///< `check` has found warnings, and no problem

/// The options of every command.
struct CliOptions {
  dds::DomainOptions dds;
  HostSelection hosts;
  double timeout_s = std::chrono::duration<double>(kDefaultTimeout).count();
  bool timeout_given = false;
  bool json = false;
  bool csv = false;
  std::string colour = "auto";       ///< as --color says it
  bool coloured = false;             ///< the result
  bool wide = false;                 ///< tables are not fitted to the terminal
  bool quiet = false;                ///< nothing is said of what is done
  std::vector<std::string> columns;  ///< the fields that are shown; empty: as usual
  std::string sort_by;               ///< a field, "-" before it: the greatest first; empty: as they come
  bool watch = false;
  double every_s = 2.0;
};

/// One run of plcctl: its options, its connection, and how it says what went wrong.
class CliSession {
 public:
  CliOptions options;

  /// Connects at the first call, for one host only if --host names one.
  [[nodiscard]] Result<ControlClient*> client();
  /// The end of the timeout, from now on.
  [[nodiscard]] TimePoint deadline() const;
  [[nodiscard]] Duration timeout() const;
  /// The same, but at least `least` from now unless --timeout says otherwise: for what takes longer.
  [[nodiscard]] TimePoint deadline(Duration least) const;

  /// The host of --host, or the only one there is. Several and no --host: an error that lists them.
  [[nodiscard]] Result<std::string> target_host();
  /// All that --host and --label select: at least one. Neither is said, and several answer: an error, as
  /// above.
  [[nodiscard]] Result<std::vector<std::string>> target_hosts();
  /// All that --host and --label select, or all that answer: at least one.
  [[nodiscard]] Result<std::vector<HostView>> shown_hosts();
  /// The same, and those that were seen before and are silent now.
  [[nodiscard]] Result<std::vector<HostView>> known_hosts();
  /// not_found: none of the hosts that are shown has an instance of that name.
  [[nodiscard]] Result<void> check_instance(const std::string& instance);

  /// Prints rows as a table, JSON or CSV, as the options say; the exit code.
  [[nodiscard]] int show(std::vector<Row> rows, std::vector<Column> columns) const;
  /// Says in one line what was done, unless --quiet, --json or --csv.
  void say(std::string_view text) const;

  /// Prints the error; returns the exit code for it.
  static int fail(const Error& error);

 private:
  [[nodiscard]] Result<std::vector<HostView>> select(const std::vector<HostView>& hosts) const;
  std::unique_ptr<ControlClient> client_;
};

/// One of the functions of ControlClient that give all samples of a topic of one host.
template <class Sample>
using Snapshot = Result<std::vector<Sample>> (ControlClient::*)(const std::string&, TimePoint);

void add_list_verbs(const Command& plcctl, CliSession& session);
void add_show_verbs(const Command& plcctl, CliSession& session);
void add_command_verbs(const Command& plcctl, CliSession& session);
void add_check_verb(const Command& plcctl, CliSession& session);
void add_post_verb(const Command& plcctl, CliSession& session);
void add_logs_verb(const Command& plcctl, CliSession& session);
void add_wait_verb(const Command& plcctl, CliSession& session);
void add_watch_verb(const Command& plcctl, CliSession& session);
void add_top_verb(const Command& plcctl, CliSession& session);
void add_variable_verbs(const Command& plcctl, CliSession& session);
void add_plant_verbs(const Command& plcctl, CliSession& session);
void add_verify_verb(const Command& plcctl, CliSession& session);
void add_debug_verb(const Command& plcctl, CliSession& session);
void add_build_verb(const Command& plcctl, CliSession& session);
void add_export_verb(const Command& plcctl, CliSession& session, const std::string& version);
void add_save_verb(const Command& plcctl, CliSession& session, const std::string& version);
void add_completion_verb(const Command& plcctl);

/// " (did you mean 'x'?)", or nothing if no name is near.
[[nodiscard]] std::string hint(std::string_view unknown, const std::vector<std::string>& known);

/// not_found, for a name that is none of `known`: "no instance 'x' on host 'h' (did you mean 'y'?); there
/// are: y, z". No host: it was looked for on all.
[[nodiscard]] std::unexpected<Error> unknown_name(std::string_view what, std::string_view name,
                                                  const std::vector<std::string>& known,
                                                  std::string_view host = {});

}  // namespace plchost
