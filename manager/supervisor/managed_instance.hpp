#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "api/control/control_handler.hpp"
#include "manager/config/manager_config.hpp"
#include "manager/store/application_keeper.hpp"
#include "manager/store/wish_keeper.hpp"
#include "manager/supervisor/heartbeat_watch.hpp"
#include "manager/supervisor/instance_host.hpp"
#include "manager/supervisor/instance_observer.hpp"
#include "manager/supervisor/instance_phase.hpp"
#include "manager/supervisor/restart_decision.hpp"
#include "manager/supervisor/starvation_watch.hpp"
#include "shm/base/stop_limits.hpp"
#include "shm/pages/host_page.hpp"
#include "shm/process/work_limit.hpp"

namespace plchost {

/// A page that does not beat for so long is not believed: the process is asked over its control socket.
inline constexpr Duration kPageLimit = std::chrono::seconds(1);
/// After so long without a sign it is looked whether other programs keep it from its core.
inline constexpr Duration kStarvationSuspected = std::chrono::milliseconds(400);
/// How often it is asked, and how often again if it does not answer.
inline constexpr Duration kAskInterval = std::chrono::milliseconds(500);
inline constexpr Duration kAskAgain = std::chrono::seconds(2);

// clang-format off
// The rules of one instance
// =========================
//
// The phases of an instance, and the steps between them: instance_phase.hpp.
// The decision after each end, and after each start that fails: restart_decision.hpp.
//
// * The order of `after` is for the first start (held) and for the end. A restart does not wait. An operator's start of
//   a held instance overrides the order.
// * An exception of the application is no crash. The process stays and answers; nothing restarts it. The manager finds
//   it in the process's page within 50 ms. start and single cycle are refused, stop has nothing to do; reset, restart
//   and load lead out of it.
// * A process whose heartbeat stands still for HeartbeatWatch::kLimit is in exception, too, until its
//   heartbeats resume. It takes no commands. A command that it was to answer fails. Commands other than
//   reset, restart, load and stop are refused, and stop is what reset is. Its end begins with SIGTERM;
//   SIGKILL follows 2 s later.
// * The manager reads state and heartbeat from the process's page. If another program has damaged the page or cut it
//   short, the manager asks the process over its control socket; the problem text says so. The page alone is no reason
//   for an exception, nor for a signal.
// * Time in which other programs keep the process from its core does not count as silence. After kLimit of such time
//   the problem text names them until its heartbeats resume. The state stays, and commands wait for their
//   limits. Such time extends the limit of the set-up.
// * Nothing is begun after the time limit of its command, also if it waited for the process or for the trial of a file
//   meanwhile. The process gets the lesser of that limit and that of the operation from now.
//
// * Orders are commands of the debugger and for variables. The process carries them out when no task is in a cycle, up to
//   2 s later. No other command waits for them, and they go on beside a stop and beside each other.
// * A task of a single cycle can halt at a breakpoint. So orders are carried out beside it, and stop, reset and restart
//   break it off.
// * A command that the process has not taken when it falls silent is never begun, also if it answers again.
//
// Commands but orders: one at a time; another one is answered with busy. A command that changes a process waits until the process
// is up. The reply comes when the thing is done, when the process ended instead, or at the limit.
//
//   command                  process is up                                held, backing off     down
//   start                    forwarded; running: done already;            spawns                spawns
//                            safe mode: refused
//   stop                     forwarded, stopping until the answer;        cancelled, offline    done already
//                            stopped, exception: done already
//   single_cycle             forwarded                                    refused               refused
//   reset, reset_cold        ends it, spawns another one, stopped         spawns, stopped       spawns, stopped
//   restart                  ends it, spawns another one, running         spawns                spawns
//   load_application         after a trial: as restart if it ran, was     as restart            failed: as restart;
//                            in safe mode or had no application;                                offline: remembered
//                            as reset if it was stopped
//   set_scheduler            forwarded; remembered if accepted            remembered            remembered
//   register_event,          forwarded; repeated in each fresh process    refused               refused
//   unregister_event
//
//   download_application     a helper keeps and checks the file; then as load_application. A fault that the trial finds
//                            ends nothing.
//                            Of all three loads: if the new application does not come up, the one before starts again
//                            as it was, with the settings that it ran with. The reply and the problem text tell it. This
//                            holds until the new one was up once, also after back-off and under the next manager.
//   rollback_application     load_application of what was loaded before. That must have been sent.
//   option "boot"            of all three: when all is done, the path becomes the boot application. The first process
//                            begins with that instead of the configuration's.
//   option "online"          of all three: the process that is up takes the application in (change_application) and
//                            goes on. Refused if there is no such process, or by it; then nothing is changed.
//
// The wish of an instance outlives the manager and the host's power (InstanceWish)
// * It is written down whenever it changes, before the command is answered. A stop, also that of a reset, is
//   written before it is carried out: the machine stays stopped, whichever process ends meanwhile.
// * The next manager goes on with it. An instance that begins with its host keeps safe mode, scheduler and application.
//   A boot application, if one was chosen, takes the application's place.
// * A configuration that names another application or scheduler than when the wish was written takes effect, as a load
//   or a change of the scheduler would. Another application also ends safe mode and failed. Another core, priority band
//   or settings file ends failed, too. It starts nothing that an operator stopped.
// * While the instance has a process, what differs waits for the next one; the problem text says so. A younger load or
//   change of the scheduler by an operator takes the place of what the configuration says.
// * If a wish was kept and cannot be read, the instance is failed: no machine starts on a guess.
//
// A configuration that is read again (reconfigure, remove)
// * An instance that is no longer in it and runs goes on running, and is `removed`. It can only be stopped, which ends
//   its process. It also ends when its application stops. It is not started again.
// * When a removed instance has no process, it is gone().
// clang-format on
class ManagedInstance : public InstanceEvents {
 public:
  /// One for all instances of a host.
  struct Surroundings {
    const HostConfig& host;
    std::string folder;                        ///< that relative application paths start in
    std::vector<std::string_view> schedulers;  ///< names that there are
    std::function<TimePoint()> now;
    InstanceObserver& observer;
  };
  /// One for each instance.
  struct Own {
    InstanceHost& host;
    ApplicationKeeper& applications;
    WishKeeper& wishes;
    std::size_t place = 0;                  ///< as the observer is told it
    std::function<void()> changed = [] {};  ///< after the observer; may call release(), nothing else
  };

  /// The surroundings outlive it.
  ManagedInstance(const InstanceConfig& config, const Surroundings& surroundings, Own own);

  /// First of all: takes over a process that is there. False: there is none.
  bool adopt();
  /// There is no process to take over: goes on as an earlier manager left it, or begins.
  void resume();
  /// Waits for what it comes after; `why` is the problem text.
  void hold(const std::string& why);
  /// Its predecessor is up.
  void release();
  void handle(const ControlRequest& request, ControlReplyFunction reply);
  /// The end of the manager: all actions are broken off, and the process ends.
  void shut_down();
  /// The configuration says something else of it, or has it again.
  void reconfigure(const InstanceConfig& config);
  /// The log level of the host is another one now.
  void use_log_level();
  /// The configuration does not have it any more.
  void remove();
  /// The part of the configuration that waits for the next process; empty: none.
  [[nodiscard]] std::string awaited_changes() const;
  [[nodiscard]] bool removed() const noexcept { return removed_; }
  /// Removed, without process and without command.
  [[nodiscard]] bool gone() const noexcept { return removed_ && phase_ == Phase::down && !operation_; }
  /// The remains of an earlier manager are known.
  [[nodiscard]] bool known() const noexcept { return earlier_.has_value(); }
  /// Reads the page of the process. To be called periodically.
  void refresh();

  [[nodiscard]] const InstanceStatus& status() const noexcept { return status_; }
  [[nodiscard]] const InstanceConfig& config() const noexcept { return config_; }
  [[nodiscard]] bool held() const noexcept { return phase_ == Phase::held; }
  /// Its successors may start.
  [[nodiscard]] bool ready() const noexcept {
    return phase_ == Phase::up && status_.state != InstanceState::safe_mode;
  }
  [[nodiscard]] bool has_process() const noexcept { return status_.pid != 0; }
  void on_report(const SetupReport& report) override;
  void on_reply(const ControlReply& reply) override;
  void on_exit(const ExitStatus& status) override;
  void on_timer() override;
  void on_application_checked(const Result<void>& result) override;

 private:
  using Phase = InstancePhase;
  enum class Ending : std::uint8_t { asked, terminated, killed };
  enum class Next : std::uint8_t { nothing, run, stay_stopped };
  enum class Step : std::uint8_t { storing, checking, fresh_process, until_up, forwarded, setting_boot };
  /// The configuration at the decision on the process, or on the next one if there is none.
  struct Configured {
    std::string application;
    std::string scheduler;
    std::string process;  // core, priority band and settings file
    bool operator==(const Configured&) const = default;
  };
  /// It was being set up when its manager ended, and may still come up.
  struct AwaitedProcess {
    TimePoint until;
    Duration interval;
  };
  struct Operation {
    ControlRequest request;
    ControlReplyFunction reply;
    Step step = Step::until_up;
    std::uint64_t forwarded_number = 0;
    std::string refused{};          // why what was to be loaded did not come up; empty: it did
    bool commanded_before = false;  // of a stop: the wish that it took the place of
    bool wanted_before = true;
    bool of_predecessor = false;  // nobody awaits its answer, unless its client asks again
  };
  struct ForwardedOrder {
    ControlRequest request;
    ControlReplyFunction reply;
    std::uint64_t number = 0;
    TimePoint until;  // its answer is awaited
  };

  // Commands: instance_commands.cpp, application_commands.cpp
  void begin(Operation operation);
  /// Begins with what operation_ asks for.
  void carry_out(ControlVerb verb);
  void begin_start();
  void begin_stop();
  void begin_load();
  void begin_download();
  void begin_rollback();
  void on_application_kept(const Result<std::string>& path);
  [[nodiscard]] bool sets_boot(ErrorCode code) const;
  void set_boot(const std::string& text);
  void tell_boot_application() const;
  [[nodiscard]] std::string loaded_text() const;
  [[nodiscard]] bool has_option(std::string_view name) const;
  [[nodiscard]] bool loads_online() const;
  [[nodiscard]] bool takes_over() const;
  [[nodiscard]] Result<void> check_online() const;
  void begin_change();
  void begin_forwarded();
  void apply_loaded_application();
  void take_back_application(const std::string& why);
  void forward_or_wait();
  // Orders, and what breaks a single cycle off: instance_orders.cpp
  /// A command that is carried out now beside others, and that no other one waits for.
  [[nodiscard]] bool is_order(ControlVerb verb) const noexcept;
  void begin_order(ControlRequest request, ControlReplyFunction reply);
  /// false: it is not the answer of an order.
  bool ends_order(const ControlReply& reply);
  void end_order(std::vector<ForwardedOrder>::iterator order, ErrorCode code, const std::string& text);
  [[nodiscard]] Result<void> check_debugger(std::string_view command) const;
  void end_orders(ErrorCode code, const std::string& text);
  void end_late_orders();
  [[nodiscard]] bool waits_for_single_cycle() const noexcept;
  /// Whether another command may begin now.
  [[nodiscard]] bool makes_room_for(ControlVerb verb);
  [[nodiscard]] std::string no_answer_text(ControlVerb verb) const;
  void forward();
  void finish(ErrorCode code, const std::string& text);
  void fail(ErrorCode code, const std::string& text);
  void look_again();
  void finish_forwarded(const ControlReply& reply);
  [[nodiscard]] Result<void> check_argument(ControlRequest& request) const;
  [[nodiscard]] Result<void> check_path(ControlRequest& request) const;
  [[nodiscard]] bool idle_phase() const noexcept {
    return phase_ == Phase::down || phase_ == Phase::held || phase_ == Phase::backing_off;
  }

  [[nodiscard]] bool loading_aside() const noexcept {  // also if the process ends meanwhile
    return operation_->step == Step::storing || operation_->step == Step::checking ||
           operation_->step == Step::setting_boot;
  }

  // Its wish, over the ends of managers: instance_wishes.cpp
  void restore();
  bool use_configuration();
  [[nodiscard]] Configured configured() const;
  void remember();
  [[nodiscard]] InstanceWish wish() const;
  [[nodiscard]] EndCause cause_of_beginning() const noexcept;
  [[nodiscard]] std::string text_of_beginning(EndCause cause) const;
  void ended_unwatched();
  void look_for_process();
  void follow_command(ControlVerb verb);
  /// Its client is told that the stop is not done, so the wish before it holds again.
  void take_back_stop();
  [[nodiscard]] std::int64_t unix_of(TimePoint time) const noexcept {
    return time.time_since_epoch().count() + unix_offset_ns_;
  }
  /// `more`: is told behind it; may be empty.
  void tell_when_kept(const Operation& done, std::string text, const std::string& more);

  // A process that does not answer, or whose page is damaged: instance_watch.cpp
  [[nodiscard]] std::optional<InstanceRuntime> watch_process();
  void ask_for_status();
  bool hear(const ControlReply& reply);
  [[nodiscard]] bool starved_now();
  void watch_heartbeat(bool starved);
  void tell_starvation();
  void watch_set_up();
  void set_up_timed_out();
  void fall_silent(std::string_view known);
  void answers_again();
  void tell_problems();
  void forget_signs();
  /// How many values of its variables are forced, as its process has said last.
  [[nodiscard]] std::uint32_t forces_of_process();

  // A process that an earlier manager has made: instance_adoption.cpp
  /// `problem`: why it has not answered; empty: it has.
  void finish_adoption(const std::string& problem);
  void wait_for_sign(const std::string& problem);
  void tell_adoption();
  void watch_adoption();
  void adoption_timed_out();
  /// The report of the process replaces the assumptions about it.
  /// A stop that its predecessor began may not have reached the process.
  void go_on_with_stop();
  void learn(const InstanceRuntime& said);

  // Life: managed_instance.cpp
  void fresh_process(Next next, StartKind kind);
  void spawn(Next next);
  void end_process(Next next);
  /// stay_stopped: its machine stood, and is not to start after the client's time limit.
  Next in_time(Next next);
  void set_up_failed(const std::string& why);
  void come_up();
  [[nodiscard]] static InstanceState shown_state(const InstanceRuntime& runtime) noexcept;
  void show_application(const InstanceRuntime& runtime);
  // Ends: instance_ends.cpp
  void set_up_ended(const ExitStatus& status, SetupStep reached);
  void asked_end();
  /// The process has ended by itself, or could not be started.
  void ended(End end, const std::string& why);
  [[nodiscard]] EndCause cause_of_refusal() const noexcept;
  [[nodiscard]] Order order() const noexcept;
  [[nodiscard]] bool rests() const noexcept;
  /// The decision, see restart_decision.hpp; the history goes on with it.
  [[nodiscard]] Decision decided(End end);
  void carry_out(const Decision& decision, const std::string& why);
  void go_down(InstanceState state, const std::string& problem);
  void set_state(Phase phase, InstanceState state, const std::string& problem);
  void publish();
  [[nodiscard]] std::string problem_when_up();
  [[nodiscard]] std::string core_problem();
  void learn_scheduler(std::string_view name);
  [[nodiscard]] LaunchOptions launch_options(Next next) const;
  [[nodiscard]] TimePoint after(Duration duration) const { return surroundings_.now() + duration; }
  [[nodiscard]] Result<std::uint64_t> send(ControlVerb verb, const std::string& argument = {},
                                           std::int64_t limit_ns = 0);
  /// With the argument of the command. The process begins with it while somebody waits: the client, and this
  /// manager.
  [[nodiscard]] Result<std::uint64_t> send_limited(ControlVerb verb, const ControlRequest& request);

  InstanceConfig config_;
  const Surroundings& surroundings_;
  Own own_;
  InstanceHost& host_;
  RestartHistory history_;

  Phase phase_ = Phase::down;
  Ending ending_ = Ending::asked;
  Next next_ = Next::nothing;                // after ending
  StartKind start_kind_ = StartKind::first;  // of the next process
  bool wants_running_ = true;                // the last wish of an operator, or of the start
  bool begins_running_ = true;               // the process starts its application by itself
  bool commanded_ = false;                   // an operator has
  bool wish_known_ = false;                  // wants_running_ is no guess
  bool shutting_down_ = false;
  bool removed_ = false;    // from the configuration
  bool transient_ = false;  // this process could not be set up, but the next one may
  // Another process has the thing that the application declares, or that its settings force. It may let go of
  // it, but the application before may do without.
  bool declaration_taken_ = false;
  bool limit_met_ = false;   // its pids_max has kept this process from being set up
  bool name_taken_ = false;  // another process of that name kept this one from being set up
  bool silent_ = false;      // its process does not beat
  HeartbeatWatch heartbeat_;
  HeartbeatWatch page_beat_{kPageLimit};   // of the page alone
  std::int64_t signs_ = 0;                 // of its control thread, from the page or over the socket
  std::int64_t last_beat_ = 0;             // in the page
  StarvationWatch starvation_;             // since its last sign
  std::int64_t seen_signs_ = 0;            // when signs_ was looked at last
  TimePoint sign_at_;                      // when it was another number first
  SetupStep step_ = SetupStep::bind_core;  // that the process takes in its set-up
  WorkLimit set_up_limit_;
  std::string starved_by_;               // for the problem text; empty: it is not starved
  bool heard_of_ = false;                // this process has given a sign
  bool page_damaged_ = false;            // the page does not tell what the process says itself
  TimePoint asked_at_;                   // for its status, last
  std::uint64_t asked_number_ = 0;       // of the answer that is awaited; 0: none is
  int answers_ = 0;                      // to that, since the page has beaten last
  std::uint32_t ended_forces_ = 0;       // by the end of a process that a command has asked for
  std::optional<InstanceRuntime> said_;  // by itself last: in its page, or when it was asked
  TimePoint up_since_{};
  TimePoint settled_{};        // when the state was last known from the process's own answer
  std::string setup_failure_;  // why the set-up failed; empty: it did not
  std::string last_end_;       // how the last process ended by itself; empty: it did not
  std::string application_;    // of the next process
  // Path of what ran before application_, until that has come up for the first time.
  std::optional<std::string> before_;
  // Why the application that was loaded last did not come up; empty: it did. If not, what ran before it runs
  // with the settings of that time, until the next command that makes a process.
  std::string taken_back_;
  std::string scheduler_;  // of the next process; empty: as its settings say
  Configured begun_with_;
  std::string said_scheduler_;  // by this process
  std::string log_level_;       // that this process was given; empty: by an earlier manager
  std::uint64_t next_number_ = 1;
  InstanceWish::Process adopted_as_ = InstanceWish::Process::none;  // by the manager before
  bool unheard_ = false;   // adopted, and it has said nothing of itself yet
  std::string unadopted_;  // why it is still being adopted after its limit, for the problem text
  std::optional<Operation> operation_;
  std::vector<ForwardedOrder> orders_;   // beside it; the process answers each
  std::int64_t unix_offset_ns_ = 0;      // of the manager's time, taken once
  std::optional<InstanceWish> earlier_;  // as the manager before left it
  std::string unreadable_;               // why it is not known; empty: it is
  std::optional<InstanceWish> kept_;     // as it was written down last
  std::optional<AwaitedProcess> awaited_;
  InstanceStatus status_;
};

/// Limits of the phases; those of commands are in the rows of shm/operations/operations.def.
inline constexpr Duration kSetupLimit = std::chrono::seconds(30);
inline constexpr Duration kAdoptLimit = std::chrono::seconds(5);
inline constexpr Duration kShutdownLimit = kStopLimit;
inline constexpr Duration kTerminateLimit = std::chrono::seconds(2);
/// The process's page is believed only this long after its own answer: it is written periodically.
inline constexpr Duration kPageLag = std::chrono::seconds(1);

}  // namespace plchost
