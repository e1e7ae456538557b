#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "instances/runtime/application/application.hpp"
#include "instances/runtime/application/application_host.hpp"
#include "instances/runtime/application/components.hpp"
#include "instances/runtime/application/declare_application.hpp"
#include "instances/runtime/application/online_change.hpp"
#include "instances/runtime/instance/application_state.hpp"
#include "instances/runtime/instance/instance_socket.hpp"
#include "instances/runtime/instance/value_server.hpp"
#include "instances/runtime/settings/device_description.hpp"
#include "instances/runtime/settings/settings.hpp"
#include "instances/runtime/setup/idle_states.hpp"
#include "instances/runtime/setup/options.hpp"
#include "instances/runtime/setup/process_setup.hpp"
#include "instances/runtime/setup/setup_reporter.hpp"
#include "instances/runtime/tasks/loss_watch.hpp"
#include "instances/runtime/time/reference.hpp"
#include "schedulers/task_set.hpp"
#include "shm/pages/debug_page.hpp"
#include "shm/pages/flight_page.hpp"
#include "shm/pages/instance_page.hpp"
#include "shm/pages/transition_ring.hpp"
#include "shm/pool/object_pool.hpp"

namespace plchost {

struct ExceptionCircumstances;
struct ExceptionEntry;

/// One PLC runtime: everything that a plc-instance process owns. All of it on the control thread; the tasks'
/// threads are TaskSet's.
class Instance {
 public:
  /// Takes the steps of SetupStep one after the other and reports each. Nothing: one failed, and was
  /// reported; all that was begun is undone.
  [[nodiscard]] static std::unique_ptr<Instance> set_up(const Options& options, SetupReporter& reporter);

  /// Ends the tasks in order, then the application and the components, and takes the instance out of the
  /// pool.
  ~Instance();
  Instance(const Instance&) = delete;
  Instance& operator=(const Instance&) = delete;

  /// Readable when serve_control() has something to do; -1: no control socket.
  [[nodiscard]] int control_fd() const noexcept { return control_ ? control_->fd() : -1; }
  void serve_control() { control_->serve(); }
  /// The same of serve_values().
  [[nodiscard]] int values_fd() const noexcept { return values_ ? values_->fd() : -1; }
  void serve_values() { values_->serve(); }
  /// Readable when advance() has something to do for its debugger; -1: the application is no debug build.
  [[nodiscard]] int debug_fd() const noexcept { return host_ ? host_->debug().fd() : -1; }

  /// Readable when serve_faults() has something to do; -1: there are no tasks.
  [[nodiscard]] int fault_fd() const noexcept { return tasks_ ? tasks_->fault_fd() : -1; }
  /// Takes the faults of tasks: each is logged, kept, and shown in the status page; one of the whole
  /// application puts it into exception.
  void serve_faults();
  /// A thread is parked in the application's code for good.
  [[nodiscard]] bool has_parked_thread() const noexcept { return parked_; }

  /// Every kHeartbeat: status page, log of the application, handles of foreign events.
  void beat();
  static constexpr auto kHeartbeat = std::chrono::milliseconds(100);

  /// Goes on with a stop, a single cycle, an online change, or requests for variables that are under way.
  /// Never waits. To be called at each heartbeat and after each request.
  void advance();
  /// How soon advance() wants to be called; nothing: no need.
  [[nodiscard]] std::optional<Duration> wants_advance_in() const noexcept;

  /// Something went wrong in the application: `reason` says what, in which task. All tasks park at the end of
  /// their cycles, nobody waits for them, and only a fresh process leads out of it.
  void enter_exception(const std::string& reason);

  /// Begins the end of the process: the tasks come to the end of their cycles, as in a stop. The second call
  /// ends the process without waiting for them.
  void begin_shutdown(std::string_view why);
  /// An end was asked for, and nothing is left to wait for.
  [[nodiscard]] bool ended() const noexcept;

  /// Takes everything apart; called once before the end. timed_out: a task is caught in its cycle; then this
  /// object cannot be destroyed, because that task's thread still uses it.
  [[nodiscard]] Result<void> shut_down();

 private:
  explicit Instance(const Options& options)
      : options_(options), scheduler_(options.launch.scheduler), life_(recorder()) {}

  // The steps of set_up().
  [[nodiscard]] Result<std::string> take_watched(SetupStep step, SetupReporter& reporter,
                                                 Result<std::string> (Instance::*take)());
  [[nodiscard]] Result<std::string> bind_core();
  [[nodiscard]] Result<std::string> lock_memory();
  [[nodiscard]] Result<std::string> read_settings_file();
  [[nodiscard]] Result<std::string> attach_pool();
  [[nodiscard]] Result<std::string> open_control_socket();
  [[nodiscard]] Result<std::string> load_components();
  [[nodiscard]] Result<std::string> load_application();
  [[nodiscard]] Result<std::string> load_confined();
  [[nodiscard]] Result<std::string> make_status_page();
  [[nodiscard]] Result<std::string> make_tasks();
  [[nodiscard]] Result<std::string> start_scheduler();

  /// The waiter for the end of a stop, of a single cycle or of an online change.
  struct Waiting {
    InstanceSocket::Asker asker;
    ControlVerb verb = ControlVerb::stop;
  };

  // Its commands: instance_control.cpp
  [[nodiscard]] std::optional<ControlReply> handle(const ControlRequest& request,
                                                   const InstanceSocket::Asker& asker);
  [[nodiscard]] Result<std::string> obey(const ControlRequest& request);
  [[nodiscard]] Result<std::string> carry_out(const ControlRequest& request);
  [[nodiscard]] Result<std::string> set_scheduler(const std::string& name);
  [[nodiscard]] static Result<std::string> set_log_level(const std::string& name);
  [[nodiscard]] Result<std::string> change_registration(const ControlRequest& request);
  [[nodiscard]] Result<std::string> reset_statistics(const std::string& task);
  [[nodiscard]] std::string status() const;

  // Another version of the application: instance_change.cpp
  [[nodiscard]] Result<std::string> begin_change(const std::string& path);
  void advance_change();
  [[nodiscard]] std::string finish_change(Duration held);
  void drop_change(const std::string& why);
  [[nodiscard]] std::optional<Duration> take_over_now();

  // Its debugger: instance_debug.cpp
  /// If the application is a debug build.
  [[nodiscard]] Result<void> attach_debugger();
  [[nodiscard]] Result<std::string> debug(const std::string& command);
  void hear_debugger();
  void advance_debugger();
  void show_debug_state();
  [[nodiscard]] bool has_debugger() const noexcept;
  /// All tasks that halt go on, and none halts until resume_debugging(). Their outputs stay safe: a stop
  /// follows.
  void let_tasks_go(std::string_view why);
  /// The same, and outputs follow their cycles again.
  void let_tasks_go_on(std::string_view why);
  void show_halts() noexcept;
  void resume_debugging();
  /// Tasks can halt from here on.
  void begin_debugging();
  /// "2 halted tasks were let go first", or nothing. Once.
  [[nodiscard]] std::string take_let_go();
  [[nodiscard]] std::string with_let_go(const std::string& text);

  // Variables that are seen from outside: instance_variables.cpp
  /// A change of variables that waits for a moment between all cycles.
  struct PendingOrder {
    InstanceSocket::Asker asker;
    ControlVerb verb = ControlVerb::write_variable;
    std::string argument;
    TimePoint limit;
    std::optional<VariableOrder> order;  ///< nothing: others came first
  };
  [[nodiscard]] Result<std::string> begin_order(const ControlRequest& request);
  [[nodiscard]] Result<void> admit_order() const;
  void advance_orders();
  void advance_values();
  /// Calls it between all cycles. False: there was no such moment.
  [[nodiscard]] bool in_moment(const std::function<void()>& action);
  void drop_orders(ErrorCode code, const std::string& why);
  void log_ended_forces(std::string_view why);

  // The life of the application: instance_life.cpp
  [[nodiscard]] ApplicationLife::Record recorder();
  /// All steps of a start that can fail.
  [[nodiscard]] Result<TaskSet::Prepared> prepare_start();
  void start(TaskSet::Prepared prepared, std::string_view why);
  [[nodiscard]] Result<std::string> start_by_command();
  void unbind(std::size_t index);
  void begin_stop(std::string_view why);
  [[nodiscard]] Result<std::string> begin_single_cycle();
  [[nodiscard]] std::string cut_single_cycle() const;
  [[nodiscard]] bool in_transition() const noexcept;
  void finish_transition(const std::vector<std::size_t>& stuck);
  [[nodiscard]] std::string time_out(std::size_t task);
  void answer_waiting(ErrorCode code, const std::string& text);

  [[nodiscard]] LoadContext load_context();
  [[nodiscard]] std::string hold_idle_states();
  [[nodiscard]] Result<void> become_own_user();
  void choose_scheduler();
  void report_tick();
  void report_clock(ClockRuntime& clock);
  void make_outputs_safe(const TaskSet::Fault& fault);
  using KeptFaults = std::vector<std::pair<TaskSet::Fault, ExceptionEntry>>;
  [[nodiscard]] ExceptionEntry keep_fault(const TaskSet::Fault& fault);
  void name_faults(const KeptFaults& kept) const;
  void write_down(const ExceptionEntry& entry) const;
  [[nodiscard]] ExceptionCircumstances circumstances_of(std::size_t index);
  [[nodiscard]] Result<void> restore_operator_events();
  void keep_settings();
  void notify_tasks(unsigned event);
  void look_after_page();
  void make_flight_recorder();
  [[nodiscard]] FlightRing flight_ring(std::size_t number);

  Options options_;
  TimePoint begun_ = MonotonicClock::now();  // the process, within milliseconds
  std::string scheduler_;
  TickReport tick_;  // as it was logged last
  std::vector<int> cores_;
  RealTimeSetup real_time_;
  StartSettings start_;
  IdleHold idle_hold_;
  NameClaim name_claim_;
  std::optional<ObjectPool> pool_;
  std::optional<ApplicationHost> host_;
  Components components_;
  std::optional<Application> application_;
  std::optional<InstancePage> page_;
  std::optional<FlightPage> flight_;  // nothing: no tasks, or no room for it
  bool page_lost_told_ = false;
  TimePoint page_told_;                   // when it was told last that the page was written over
  std::uint64_t page_damages_ = 0;        // how often it was
  std::unique_ptr<Reference> reference_;  // null: none is named
  std::string clock_silence_;             // as the log has it; empty: it is followed
  LinuxClock clock_;
  std::unique_ptr<TaskSet> tasks_;  // uses all of the above: destroyed before them
  std::optional<LossWatch> losses_;
  std::unique_ptr<OnlineChange> change_;  // waits for a moment between all cycles
  TimePoint change_ends_;                 // at the latest
  std::optional<InstanceSocket> control_;
  std::optional<ValueServer> values_;
  std::deque<PendingOrder> orders_;
  std::optional<TransitionRing> transitions_;
  std::optional<DebugPage> debug_page_;  // of a debug build
  TimePoint debug_shown_;                // when it was written last
  std::size_t let_go_ = 0;               // halted tasks, of which no reply has told yet
  ApplicationLife life_;
  std::vector<bool> unbound_;  // tasks of external events that run nothing any more, since the last start
  std::optional<Waiting> waiting_;
  TimePoint single_cycle_ends_;  // at the latest
  bool shutdown_requested_ = false;
  bool hurried_ = false;
  bool is_down_ = false;
  bool parked_ = false;
};

}  // namespace plchost
