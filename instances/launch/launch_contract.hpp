#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "shm/base/result.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// Why a process begins, for the application that asks (plc_start_kind). The numbers are those of plc_app.h.
enum class StartKind : std::uint8_t {
  first = 0,        ///< by hand, by the manager's first start of it, or with another application
  warm = 1,         ///< after a warm reset or a restart
  cold = 2,         ///< after a cold reset: the application is to begin with initial values
  after_fault = 3,  ///< the process before ended by itself
};
[[nodiscard]] std::string_view to_string(StartKind kind) noexcept;
/// invalid_argument: no such kind; the text lists what there is.
[[nodiscard]] Result<StartKind> start_kind_of(std::string_view name);

/// The options of a plc-instance at its start, by the manager or by hand. Both ends use this file, so that
/// the command line has one home.
struct LaunchOptions {
  std::string name;                      ///< --name, at most kMaxInstanceName
  std::vector<int> cores;                ///< --core N[,N...]; empty: wherever it was started
  std::string scheduler;                 ///< --scheduler; empty: as the settings say, else CmpSchedule
  std::string priority_band = "normal";  ///< --priority-band high|normal|low
  /// --kept-settings: with the texts of the settings files that the process before came up with, as it has
  /// left them in kept_settings_path(). Paths and places in messages stay those of `settings`.
  bool kept_settings = false;
  std::string settings;          ///< --settings FILE in the seeds' [Section] Key=Value form; may be empty
  std::string application;       ///< --application FILE; empty: none (safe mode)
  std::string pool = "plchost";  ///< --pool NAME
  std::string run_directory;     ///< --run-directory DIR; empty: no control socket (by hand)
  std::string state_directory;  ///< --state-directory DIR: for what outlives a power cut; empty: nothing does
  std::string user;             ///< --user NAME or number; empty: that of the caller
  std::string control_group;  ///< --control-group DIR: the control group to run in; empty: that of the caller
  std::optional<int> oom_score;             ///< --oom-score N: oom_score_adj; nothing: that of the caller
  std::vector<unsigned> trusted_users;      ///< --trusted-user N: their pages are those of instances, too
  bool no_debug = false;                    ///< --no-debug: an application that is a debug build is refused
  bool stopped = false;                     ///< --stopped: load the application, do not start it
  StartKind start_kind = StartKind::first;  ///< --start-kind first|warm|cold|after-fault
  int report_fd = -1;              ///< --report-fd N: where SetupReports go; -1: standard error, as text
  std::string log_level = "info";  ///< --log-level
};

/// The words of `plc-instance --check-application` for a valid one, behind its path: the proof that the trial
/// came to its end.
inline constexpr std::string_view kValidApplication = " is a valid application: ";

/// How long the set-up of an application may take in a trial.
inline constexpr Duration kSetUpLimit = std::chrono::seconds(10);

/// `plc-instance --save-retain` writes what the retain memory of an instance holds to its retain files, and
/// ends with code 0 if they hold all of it. It needs the name, the pool, the settings and the state
/// directory.
inline constexpr std::string_view kSaveRetainOption = "--save-retain";

/// argv for posix_spawn, argv[0] included.
[[nodiscard]] std::vector<std::string> to_arguments(const std::string& program, const LaunchOptions& options);

/// The control socket of an instance: "RUN_DIRECTORY/NAME.sock". ControlRequests in, ControlReplies out.
[[nodiscard]] std::string instance_socket_path(std::string_view run_directory, std::string_view instance);

/// Held by the process of an instance as long as it runs: "RUN_DIRECTORY/NAME.claim".
[[nodiscard]] std::string instance_claim_path(std::string_view run_directory, std::string_view instance);

/// Where a process keeps the texts of its settings files when it is up: "RUN_DIRECTORY/NAME.settings".
[[nodiscard]] std::string kept_settings_path(std::string_view run_directory, std::string_view instance);

/// The shared memory of the pool in which the retain variables of an instance lie: "NAME.retain". It outlives
/// the process.
[[nodiscard]] std::string retain_memory_name(std::string_view instance);

/// The steps that an instance takes before it runs, in order. A failed one is reported by name.
enum class SetupStep : std::uint8_t {
  bind_core,
  lock_memory,
  read_settings,
  attach_pool,
  open_control_socket,
  load_components,
  load_application,
  make_status_page,  ///< before the tasks, whose statistics lie in it
  make_tasks,
  start_scheduler,
  ready,  ///< all done; the control socket answers
};
[[nodiscard]] std::string_view to_string(SetupStep step) noexcept;

/// One packet on the report descriptor (a SEQPACKET socket). It reports a step: done (code ok), done with a
/// remark (ok and a text), or failed (the last one; the process then ends with kExitSetupFailed).
struct SetupReport {
  SetupStep step = SetupStep::bind_core;
  ErrorCode code = ErrorCode::ok;
  std::string text;
  bool transient = false;  ///< of a failed one: see is_transient()
};
[[nodiscard]] std::string encode(const SetupReport& report);
[[nodiscard]] Result<SetupReport> decode_report(std::string_view packet);

/// The number of the last ApplicationState.
inline constexpr unsigned kLastApplicationState = 5;

/// An instance's answer to a request for its status on its control socket.
struct InstanceReport {
  int pid = 0;
  unsigned state = 0;       ///< ApplicationState
  std::string problem;      ///< why it is in exception; else empty
  std::string application;  ///< path; empty: none
  std::string scheduler;    ///< in use, or what the next start will use
  std::vector<int> cores;   ///< read back from the kernel
  bool memory_locked = false;
};
[[nodiscard]] std::string encode(const InstanceReport& report);
[[nodiscard]] Result<InstanceReport> decode_instance_report(std::string_view text);

/// Exit codes of plc-instance.
inline constexpr int kExitUsage = 2;
inline constexpr int kExitSetupFailed = 3;

}  // namespace plchost
