// The client library of plchost: sees and commands PLC hosts from anywhere over DDS, by api/control.idl.
//
// g++ -std=c++20 x.cpp $(pkg-config --cflags --libs plchost-client)
//
//     #include <plchost/plchost_client.hpp>
//
//     int main() {
//       plchost::Client client;
//       client.post("south", "line1/product");                // returns when it is in the host's pool
//       const auto watch = client.watch_tasks("south", [](const plchost::Client::Task& task) {
//         std::printf("%s/%s: %llu cycles\n", task.instance.c_str(), task.name.c_str(), task.cycles);
//       });
//       std::this_thread::sleep_for(std::chrono::minutes(1));
//     }
//
// Everywhere: `host` is the name of a host; empty: Options::host, or the only one that answers (an error if
// several do). An event is "INSTANCE/EVENT". Times are in the unit that their type says; wall-clock times are
// the host's.
//
// Connections make and mend themselves: a host may come later, end and come back, and so may the network. A
// call waits for its host as long as Options::timeout says; a watch goes on when its host does.
//
// All functions may be called from any thread; none is for real-time threads. The calls of one Client to one
// host are done one after the other, in the order in which they were made. Those to other hosts go on at the
// same time. While it is not known which host answers a call that names none, later calls wait. A download
// and post_and_wait() hold up none. A callback, also one that tells the progress of a download, runs on a
// thread of the library and may use the Client. The other callbacks of calls wait meanwhile, and a download
// stands still: after 10 s of that it is given up. A callback must not wait for a second download to the same
// host. It must not throw: the program would end. All Clients of a process for one domain share a DDS
// participant, so they have the same options for DDS.
// In a child of fork() a Client of the parent throws `unavailable`: make another one.
#ifndef PLCHOST_CLIENT_HPP
#define PLCHOST_CLIENT_HPP

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "plchost_client_types.hpp"

#define PLCHOST_CLIENT_API __attribute__((visibility("default")))

namespace plchost {

/// The kind of an error. what() says where, and what to do.
class PLCHOST_CLIENT_API ClientError : public std::runtime_error {
 public:
  /// The numbers are those of Reply.code in api/control.idl; there may be more some day.
  enum Code {
    invalid_argument = 1,  ///< a name or value is not of the allowed form; nothing was sent
    not_found = 2,         ///< no such host, instance, event ...
    already_exists = 3,    ///< an event that is registered
    wrong_state = 4,       ///< cannot be done now (stop what is stopped)
    refused = 5,           ///< not permitted
    busy = 6,              ///< too much at once: again later
    timed_out =
        7,  ///< no answer. The host begins nothing after that time; whether it began before is not known
    unavailable = 8,   ///< DDS or the manager of the host is not there
    failed = 9,        ///< a system call of the host, or here
    unsupported = 10,  ///< not by that host
    full = 11,         ///< a table or the pool of the host
    corrupt = 12,      ///< a file or memory of the host is not valid
    wrong_type = 13,   ///< an object of the pool has that name and another type; or no plain file
    wrong_size = 14    ///< a memory of that name has another size; or a file is empty or too large
  };

  ClientError(int code, const std::string& text) : std::runtime_error(text), code_(code) {}
  ~ClientError() override;
  int code() const noexcept { return code_; }

 private:
  int code_;
};

/// How an application is loaded.
struct LoadOptions {
  bool boot = false;  ///< the instance starts with it from now on, also after a restart of the host
  bool online =
      false;  ///< it takes over while the tasks run: no cycle is lost; refused where it does not fit
};

/// A client of all hosts of one domain: one participant of DDS, and the threads of its own. All functions may
/// be called from any thread, and wait as long as their documentation says. Errors are ClientError.
class PLCHOST_CLIENT_API Client {
 public:
  struct Options {
    unsigned domain = 0;                        ///< DDS domain, 0 to 230
    std::vector<std::string> interfaces{"lo"};  ///< network interfaces
    std::vector<std::string> peers{};           ///< addresses of hosts; none: 127.0.0.1
    std::string identity{};                   ///< folder of `plcctl security add-identity`; empty: unsecured
    std::chrono::milliseconds timeout{3000};  ///< of each call, 1 ms to an hour
    /// The Client is for this one host; empty: for all. No other host sends it anything, `host` of a call may
    /// be left out, and another one is an invalid_argument.
    std::string host{};
  };

  // The state of hosts, as the contract has it: plchost_client_types.hpp is made from control.idl.

  struct Host : client_types::Host {
    bool answers = false;  ///< false: silent for more than 70 ms, or gone
    unsigned instances = 0;

    friend bool operator==(const Host& a, const Host& b) {
      return static_cast<const client_types::Host&>(a) == b && a.answers == b.answers &&
             a.instances == b.instances;
    }
    friend bool operator!=(const Host& a, const Host& b) { return !(a == b); }
  };
  using Instance = client_types::Instance;
  using Application = client_types::Application;
  using Task = client_types::Task;
  using Event = client_types::Event;
  using Writer = client_types::Writer;
  using Exception = client_types::Exception;
  using Loss = client_types::Loss;
  using TaskStatistics = client_types::TaskStatistics;
  using Object = client_types::Object;
  using Node = client_types::Node;
  using Route = client_types::Route;
  using Variable = client_types::Variable;
  using Finding = client_types::Finding;

  /// Variables of an application, with their values of one moment.
  struct Sample {
    std::chrono::system_clock::time_point time;  ///< by the clock of the host
    bool consistent = true;                      ///< no task was within a cycle
    std::vector<Variable> variables;
  };

  /// How variables are recorded.
  struct RecordOptions {
    std::chrono::milliseconds interval{100};  ///< from one sample to the next, 10 ms to an hour
    std::chrono::milliseconds duration{0};    ///< up to 1e9 s; 0: no end after a time
    unsigned long long count = 0;             ///< of samples; 0: no end after a number
    /// Asked after each sample, and each 0.1 s while the call waits, on its thread. False ends the recording.
    /// An exception does, too, and comes out of the call.
    std::function<bool()> goes_on = {};
  };
  /// Takes the next lines of a recording. False: it is enough.
  using RecordSink = std::function<bool(const std::string& lines)>;

  /// A variable that is forced.
  struct Force : Variable {
    std::string host;
    std::string instance;
  };

  /// A sample of a watch of variables, or why there is none.
  struct Sampled {
    int code = 0;      ///< 0: there is one; else ClientError::Code
    std::string text;  ///< why there is none
    Sample sample;
    explicit operator bool() const noexcept { return code == 0; }
  };

  /// The clock of a host, as seen from here.
  struct Clock {
    std::chrono::nanoseconds offset{};  ///< of the host's CLOCK_REALTIME: positive: ahead of the one here
    std::chrono::nanoseconds uncertainty{};  ///< the greatest error of that
  };

  /// A change of state.
  struct Transition : client_types::Transition {
    unsigned long long missed = 0;  ///< how many before it will never come
  };

  /// A line that an instance has said: its application, its runtime, or the manager about it. Lines may leave
  /// numbers out.
  struct LogLine : client_types::LogLine {
    std::string host;
    std::string instance;
    unsigned long long missing = 0;  ///< lines before it that the host has kept no longer
    unsigned long long stream = 0;   ///< numbers of another stream began anew: the host has lost its memory
  };

  /// Posts that are in the pool of the host.
  struct Posted {
    unsigned long long accepted = 0;
    unsigned long long no_task = 0;  ///< of these, while no task was bound to the event
  };

  /// A post that was run.
  struct Run {
    unsigned tasks = 0;                   ///< that were bound to the event
    std::string last_task;                ///< "INSTANCE/TASK" that ended its cycle last
    std::chrono::nanoseconds to_start{};  ///< on the host: from the post's arrival to the start of that cycle
    std::chrono::nanoseconds to_end{};    ///< and to its end
    std::chrono::nanoseconds round_trip{};  ///< here: from before the post to after the news
  };

  /// The result of a call with a callback.
  struct Outcome {
    int code = 0;      ///< 0: done; else ClientError::Code
    std::string text;  ///< why not
    Posted posted;
    explicit operator bool() const noexcept { return code == 0; }
  };

  /// Told how many bytes of a file have arrived. The download stands still until this returns.
  using Progress = std::function<void(unsigned long long received)>;

  /// A member of a status topic: codes are words, durations and times nanoseconds, GUIDs hexadecimal digits.
  using Value = std::variant<bool, long long, unsigned long long, std::string>;
  using Record = std::vector<std::pair<std::string, Value>>;

  /// A command that a host knows.
  struct Operation {
    std::string name;              ///< "set scheduler"
    std::string argument;          ///< "scheduler", "event", "path", "task"; empty: it takes none
    bool may_be_left_out = false;  ///< the argument
    std::string help;              ///< one sentence
    bool names_instance = false;   ///< else it is for the whole host
    bool engineering = false;      ///< for engineers; others are for operators, too
    bool loads = false;            ///< LoadOptions count
  };

  /// Calls its callback until it is destroyed or stop() returns; after that never again (stop() waits for a
  /// callback that is running, unless it is called by that). It may outlive its Client.
  class PLCHOST_CLIENT_API Watch {
   public:
    Watch() noexcept;
    Watch(Watch&& other) noexcept;
    Watch& operator=(Watch&& other) noexcept;
    ~Watch();
    void stop() noexcept;

   private:
    friend class Client;
    class Subscription;
    explicit Watch(std::shared_ptr<Subscription> subscription) noexcept;
    std::shared_ptr<Subscription> subscription_;
  };

  /// Connects at the first call. ClientError: invalid_argument: an option; or another Client of this process
  /// has other interfaces or peers, or another identity, in the same domain.
  Client();
  explicit Client(const Options& options);
  /// As close().
  ~Client();
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  /// Ends all watches, and waits for the calls that are under way; those that wait for others, and all that
  /// come, end with unavailable. Not from a callback.
  void close();

  /// All that answer, by name. None: an empty list, after the timeout.
  std::vector<Host> hosts();
  /// All of one host, as it is within 20 ms (instances) or 200 ms (others). These and all that follow throw
  /// ClientError.
  std::vector<Instance> instances(const std::string& host = {});
  std::vector<Task> tasks(const std::string& host = {});
  std::vector<Event> events(const std::string& host = {});
  /// The applications that were sent to the instances and are kept there.
  std::vector<Application> applications(const std::string& host = {});
  /// The last exception of each instance; count 0: it never had one.
  std::vector<Exception> exceptions(const std::string& host = {});
  /// The last lost cycles of the tasks, with their causes.
  std::vector<Loss> losses(const std::string& host = {});
  /// The fate of the posts of each client; first (source all zero) of all together.
  std::vector<Writer> writers(const std::string& host = {});
  /// All figures of a task, at most a second old. From the first call on, the Client receives the figures of
  /// all tasks that it sees, some KiB for each and second. On a large plant make one with Options::host for
  /// it. ClientError: timed_out: also if there is no such task.
  TaskStatistics statistics(const std::string& host, const std::string& instance, const std::string& task);

  /// The objects of the pool whose names match the pattern ('*' any characters, '?' one; empty: all), by
  /// name. For these and all that follow up to check_host(): ClientError: refused: only operators may ask.
  std::vector<Object> objects(const std::string& host = {}, const std::string& pattern = {});
  /// The nodes that send each other blocks, by address. `base`: the set of nodes; empty: that of the host's
  /// configuration.
  std::vector<Node> nodes(const std::string& host = {}, const std::string& base = {});
  /// How blocks go from one of these nodes to another, or to other hosts.
  std::vector<Route> routes(const std::string& host = {}, const std::string& base = {});
  /// All variables that an application declares, or those like one of the patterns, by name. In a pattern '*'
  /// is any characters, '?' one; "Grid[1,2]" is an element, "Grid[*,*]" each of them. Case does not count.
  /// ClientError: not_found: no such variable, or it declares none.
  std::vector<Variable> variables(const std::string& host, const std::string& instance,
                                  const std::vector<std::string>& patterns = {});
  /// The same, with their values of one moment. ClientError: full: more than 1024, or 96 KiB of them.
  Sample sample(const std::string& host, const std::string& instance,
                const std::vector<std::string>& patterns);
  /// Writes samples into a file as CSV, as `plcctl record variables` does: a line with the names, then a line
  /// for each sample(). Returns their number after the duration or the count, whichever comes first; one of
  /// them must be given. The file is made with the first sample, and replaces one of that name. A host or
  /// instance that is started anew meanwhile is waited for. Calls and watches hold up no sample. Samples that
  /// were written stay. Not from a callback of a call or of a watch of variables: wrong_state. ClientError:
  /// as sample(), at the first sample. timed_out, unavailable or busy: also if there was no answer at the
  /// end. wrong_state: the application has other variables by now. failed: the file takes no more.
  unsigned long long record_variables(const std::string& host, const std::string& instance,
                                      const std::vector<std::string>& patterns, const RecordOptions& options,
                                      const std::string& file);
  /// The same; gives the lines to `sink`, on this thread: first the names and a sample, then a sample each
  /// time. With neither duration nor count it goes on until `sink` returns false. An exception of `sink` ends
  /// it, and comes out of this call.
  unsigned long long record_variables(const std::string& host, const std::string& instance,
                                      const std::vector<std::string>& patterns, const RecordOptions& options,
                                      const RecordSink& sink);
  /// The variables of a host that are forced, with the values that they are forced to; of an array, each
  /// element that is. Empty instance: of all. ClientError: not_found: no such instance.
  std::vector<Force> forces(const std::string& host = {}, const std::string& instance = {});
  /// Asks the host for its time, several times: the best answer counts.
  Clock read_clock(const std::string& host = {});
  /// Has the host looked at anew. The result of each check, also of those that found nothing wrong.
  std::vector<Finding> check_host(const std::string& host = {});

  /// The status topics of the contract by name: "task", "writer", "exception".
  static std::vector<std::string> topics();
  /// All samples of one of them, complete: each with its members by their names in the contract, in their
  /// order there. Members that only a newer host has come last, as texts. ClientError: invalid_argument: no
  /// such topic; unsupported: the host is older than the topic.
  std::vector<Record> status(const std::string& topic, const std::string& host = {});

  /// The lines of an instance, oldest first: the `newest` lines of those that the host keeps (256 KiB for
  /// each instance). ClientError: not_found: no such instance; refused: only operators may ask.
  std::vector<LogLine> logs(const std::string& host, const std::string& instance,
                            unsigned long long newest = ~0ULL);
  /// The lines after one that was returned before, to read on; all that are kept, if the host has begun anew.
  std::vector<LogLine> logs(const std::string& host, const std::string& instance, const LogLine& after);

  /// Posts an event `count` times, each counted exactly once, also if the server of the host ends meanwhile.
  /// Returns when all are in the pool: the timeout is for each acknowledgement, so many take as long as they
  /// take. ClientError: a post was rejected; timed_out: of some nothing is known.
  Posted post(const std::string& host, const std::string& event, unsigned long long count = 1);
  /// The same; returns at once. `done` is called once. At most 1024 calls may be under way:
  /// for one more, `done` is called with full (11) before this returns. A call whose `done` is called is none
  /// of them any more.
  void post(const std::string& host, const std::string& event, std::function<void(const Outcome&)> done);
  /// Posts several events, at most 64, at once: all of them, or none.
  Posted post_all(const std::string& host, const std::vector<std::string>& events);
  /// Posts once and waits until the tasks that are bound to the event have ended their cycles for it. If the
  /// instance is starting, the event is posted once its tasks take posts.
  Run post_and_wait(const std::string& host, const std::string& event);

  /// Commands. Each returns when it is done; the next look at the status shows its effect. The text that is
  /// returned is the host's remark, mostly empty.
  std::string start(const std::string& host, const std::string& instance);
  std::string stop(const std::string& host, const std::string& instance);
  std::string restart(const std::string& host, const std::string& instance);
  /// Warm: retain memory is kept; cold: only persistent memory is.
  std::string reset(const std::string& host, const std::string& instance, bool cold = false);
  std::string single_cycle(const std::string& host, const std::string& instance);
  /// `path`: of a file on the host.
  std::string load_application(const std::string& host, const std::string& instance, const std::string& path,
                               const LoadOptions& options = {});
  /// Loads the predecessor of the loaded version again.
  std::string rollback_application(const std::string& host, const std::string& instance,
                                   const LoadOptions& options = {});
  /// Sends a file of this machine to the instance, where it is checked, kept and loaded. Goes on when the
  /// server of the host ends meanwhile. The timeout is for the host to begin; then the call takes as long as
  /// the file needs, and ends when nothing has moved for 10 s. `progress` is told how many bytes have
  /// arrived, on a thread of the library; from the beginning again if the server had to be started again.
  /// If other callbacks run meanwhile, it is told the newest number after them.
  std::string download_application(const std::string& host, const std::string& instance,
                                   const std::string& file, const LoadOptions& options = {},
                                   const Progress& progress = {});
  /// The same; returns at once. `done` is called once, as that of post(); its text is the host's remark.
  void download_application(const std::string& host, const std::string& instance, const std::string& file,
                            const LoadOptions& options, const Progress& progress,
                            std::function<void(const Outcome&)> done);
  std::string set_scheduler(const std::string& host, const std::string& instance,
                            const std::string& scheduler);
  std::string register_event(const std::string& host, const std::string& event);
  std::string unregister_event(const std::string& host, const std::string& event);
  /// Writes a variable, or an element of one ("Grid[1,2]"), once and between two cycles. `value`: as
  /// Structured Text writes it: "5", "TRUE", "T#1s", "'text'". Returns the value before and after.
  /// A name with '=', '*', '?' or a control character is an invalid_argument, and nothing is sent.
  /// ClientError: invalid_argument: also a value that is not of the type; not_found: no such variable;
  /// refused: it is read-only, or this takes another role.
  std::string write_variable(const std::string& host, const std::string& instance, const std::string& name,
                             const std::string& value);
  /// The variable has this value at the begin and the end of each cycle, until it is unforced or the instance
  /// is reset. Else as write_variable().
  std::string force_variable(const std::string& host, const std::string& instance, const std::string& name,
                             const std::string& value);
  /// The variable keeps the value that it has. "*": unforce_all(). ClientError: wrong_state: it is not
  /// forced; else as above.
  std::string unforce_variable(const std::string& host, const std::string& instance, const std::string& name);
  /// Of all forced variables of the instance, also of none.
  std::string unforce_all(const std::string& host, const std::string& instance);
  /// Has the host read its configuration file again. Instances that are unchanged run on. Returns a line for
  /// each change, with when it is used; "nothing has changed". ClientError: invalid_argument: the file has
  /// errors, a line each, and nothing is changed. Give the Client a timeout of 60 s if the file has many
  /// instances: each application is tried.
  std::string reload(const std::string& host = {});

  /// The commands of command(): all but a download. From the table that hosts and plcctl go by.
  static std::vector<Operation> operations();
  /// A command by its name ("reset statistics"); those above are such commands, too. Returns when it is done.
  /// ClientError: invalid_argument: no such command, the text lists them; or options that it does not take.
  std::string command(const std::string& operation, const std::string& host, const std::string& instance = {},
                      const std::string& argument = {}, const LoadOptions& options = {});
  /// The same; returns at once. `done` is called once, as that of post(); its text is the host's remark.
  void command(const std::string& operation, const std::string& host, const std::string& instance,
               const std::string& argument, std::function<void(const Outcome&)> done,
               const LoadOptions& options = {});

  /// Calls back for each host that is there, and whenever one comes, falls silent, answers again, or has
  /// changed; its load alone is no change. Known within 100 ms.
  Watch watch_hosts(std::function<void(const Host&)> callback);
  /// For each that is there, whenever something in it has changed, and once with `removed` when the host has
  /// it no more. Empty host: of all.
  Watch watch_instances(const std::string& host, std::function<void(const Instance&)> callback);
  Watch watch_tasks(const std::string& host, std::function<void(const Task&)> callback);
  Watch watch_events(const std::string& host, std::function<void(const Event&)> callback);
  Watch watch_applications(const std::string& host, std::function<void(const Application&)> callback);
  Watch watch_exceptions(const std::string& host, std::function<void(const Exception&)> callback);
  /// The same for any status topic, by its name, as status() has them; last in each record is `removed`.
  /// ClientError: invalid_argument: no such topic.
  Watch watch_status(const std::string& topic, const std::string& host,
                     std::function<void(const Record&)> callback);
  /// For the last 64 of each instance, and each that comes. Empty host: of all.
  Watch watch_transitions(const std::string& host, std::function<void(const Transition&)> callback);
  /// Samples the variables that match the patterns, as sample(), and calls back with each sample: a group of
  /// one moment each time. `interval`: from one sample to the next, 10 ms to an hour. A sample whose time has
  /// passed meanwhile is left out. If there is none, the reason is told once, and the watch goes on: the
  /// host, the instance or the variable may come later. Calls and other watches hold up no sample, but the
  /// callbacks of all watches of variables run one after the other. ClientError: invalid_argument: the
  /// interval, or a pattern that can match nothing.
  Watch watch_variables(const std::string& host, const std::string& instance,
                        const std::vector<std::string>& patterns, std::chrono::milliseconds interval,
                        std::function<void(const Sampled&)> callback);

 private:
  class Worker;
  class Watcher;
  class LookingWatch;
  class HostsWatch;
  template <class TopicSample>
  class StatusWatch;
  class RecordsWatch;
  class TransitionsWatch;
  class VariablesWatch;
  Watch begin_watch(std::shared_ptr<LookingWatch> subscription);
  template <class TopicSample, class Item>
  Watch watch_items(const std::string& host, std::function<void(const Item&)> callback);

  std::unique_ptr<Worker> worker_;
  std::unique_ptr<Watcher> watcher_;
};

}  // namespace plchost

#endif
