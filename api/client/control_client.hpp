#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include <control.h>
#include <status_topics.hpp>

#include "api/client/client_core.hpp"
#include "api/client/client_types.hpp"
#include "shm/base/result.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// The client's end of the DDS API: sees all hosts of a domain (of names, at most SeenHosts::kMost) and
/// addresses any. One thread at a time. Each call is one of its ClientCore, and is waited for; those that are
/// under way there already go on meanwhile. A client for one host reads that host's partition only, so no
/// other host sends it anything. It sees no other host, and refuses to address one (invalid_argument).
/// Nothing here waits beyond the deadline it was given; deadlines are of MonotonicClock. A name that no host,
/// instance, event or task can have, or a text that is too long, gives invalid_argument. Nothing is sent
/// then.
class ControlClient {
 public:
  /// A host that has not shown its presence for so long is gone.
  static constexpr Duration kHostGone = ClientCore::kHostGone;
  /// A host is silent after so long: a little less than the deadline of its presence, so that a thread that
  /// is woken by that sees it.
  static constexpr Duration kSilent = ClientCore::kSilent;
  /// All hosts are known when none was news for so long, and none is late (LateWriters). Where packets can be
  /// lost, it is longer than it takes until each host tells again that it is there (SPDPInterval).
  static constexpr Duration kQuiet = ClientCore::kQuiet;
  static constexpr Duration kQuietOnNetworks = ClientCore::kQuietOnNetworks;

  /// With a participant of its own. `only`: it is for that one host; empty: for all.
  [[nodiscard]] static Result<std::unique_ptr<ControlClient>> connect(const dds::DomainOptions& options,
                                                                      std::string_view only = {});
  /// Beside others of this process, which have the same participant and may be on other threads.
  [[nodiscard]] static Result<std::unique_ptr<ControlClient>> connect(
      std::shared_ptr<Participant> participant, std::string_view only = {});
  /// The one host that it is for; empty: all.
  [[nodiscard]] const std::string& only() const noexcept { return core_->only(); }
  [[nodiscard]] const std::shared_ptr<Participant>& participant() const noexcept {
    return core_->participant();
  }
  /// For calls that are not waited for one after the other. Its thread is this one.
  [[nodiscard]] ClientCore& core() noexcept { return *core_; }
  /// Waits for one of them, and returns its result.
  template <class T>
  [[nodiscard]] T wait(Async<T> call) {
    return core_->pump().complete(std::move(call));
  }

  /// The hosts that answer, by name: waits for the first one until the deadline, then until none is news any
  /// more. A host that DDS has discovered and that has not answered yet is waited for, for
  /// LateWriters::kPatience or half of the time until the deadline. Empty: none answers.
  [[nodiscard]] std::vector<HostView> hosts(TimePoint deadline);
  /// The same, and those that were seen before and are silent now; of more than SeenHosts::kMost, those that
  /// have been gone for a minute are forgotten.
  [[nodiscard]] std::vector<HostView> known_hosts(TimePoint deadline);
  /// Asks a host for its time, several times: the best of them counts. refused: only operators may ask.
  [[nodiscard]] Result<ClockOffset> clock_offset(const std::string& host, TimePoint deadline);
  /// That host, as soon as it is seen. not_found: it does not answer; the text lists the hosts that do (for a
  /// client for one host: those that DDS has discovered), and which of them may be meant.
  [[nodiscard]] Result<HostView> host(std::string_view name, TimePoint deadline);

  /// Whether a host that was seen does not show its presence at present: its server has ended, or hangs, or
  /// cannot be reached. Known within 100 ms, also if threads of DDS still run there; wait_for_change()
  /// returns when it begins and when it ends. A host that stays silent is gone after kHostGone.
  [[nodiscard]] bool is_silent(std::string_view host);

  /// All samples of a status topic that a host shows, complete: waits until as much has come as the host says
  /// there is. In the order that control.idl says. timed_out: not complete at the deadline. unsupported: the
  /// host is of a version that has no such topic. Defined in client_core_status.hpp.
  template <class Sample>
  [[nodiscard]] Result<std::vector<Sample>> status(const std::string& host, TimePoint deadline);
  /// The same, by name.
  [[nodiscard]] Result<std::vector<plc_InstanceStatus>> instances(const std::string& host,
                                                                  TimePoint deadline);
  [[nodiscard]] Result<std::vector<plc_TaskStatus>> tasks(const std::string& host, TimePoint deadline);
  /// The statistics of one task, as the host told them last: at most about a second old.
  /// timed_out: they have not come at the deadline; there may be no such task.
  [[nodiscard]] Result<StatisticsReport> statistics(const std::string& host, std::string_view instance,
                                                    std::string_view task, TimePoint deadline);
  [[nodiscard]] Result<std::vector<plc_EventStatus>> events(const std::string& host, TimePoint deadline);
  /// The fate of the posts of each client, as the host counts them; first (source all zero) of all together.
  [[nodiscard]] Result<std::vector<plc_WriterStatus>> writers(const std::string& host, TimePoint deadline);
  /// A part of the objects of a host's pool, as the query asks, with all that is known of them; complete: the
  /// last one. Else go on with query.after = next_after. The code of the failure is the host's own:
  /// not_found: no object of the query's name.
  [[nodiscard]] Result<ObjectListing> list_objects(const std::string& host, const ObjectQuery& query,
                                                   TimePoint deadline);
  /// The nodes of a host that send blocks, or a part of the ways between them, with what they count. Not
  /// complete: go on with query.after = next_after. not_found: no node of the query's name.
  [[nodiscard]] Result<NodesTold> list_nodes(const std::string& host, const NodeQuery& query,
                                             TimePoint deadline);
  [[nodiscard]] Result<NodesTold> list_routes(const std::string& host, const NodeQuery& query,
                                              TimePoint deadline);
  /// A part of what an instance has said. Not complete: go on with query.after = next_after. The code of the
  /// failure is the host's own: not_found: it has no such instance.
  [[nodiscard]] Result<LogListing> read_log(const std::string& host, const std::string& instance,
                                            const LogQuery& query, TimePoint deadline);
  /// A part of the variables that an instance's application declares, with their values of one moment. Not
  /// complete: go on with query.after = next_after. The code of the failure is the host's own: not_found: no
  /// such instance or variable, or it declares none.
  [[nodiscard]] Result<VariableListing> list_variables(const std::string& host, const std::string& instance,
                                                       const VariableQuery& query, TimePoint deadline);
  /// The state of the debugger of an instance, or a part of it. The code of the failure is the host's own:
  /// not_found: no such instance, or its application is no debug build.
  [[nodiscard]] Result<DebugPart> read_debug(const std::string& host, const std::string& instance,
                                             const DebugQuery& query, TimePoint deadline);
  /// One for each instance; count 0: it never had an exception.
  [[nodiscard]] Result<std::vector<plc_ExceptionStatus>> exceptions(const std::string& host,
                                                                    TimePoint deadline);

  /// Has the host looked at anew, and returns what each check found, in their order. The code of the failure
  /// is the host's own; timed_out: not complete at the deadline.
  [[nodiscard]] Result<std::vector<plc_HostFinding>> check_host(const std::string& host, TimePoint deadline);

  /// The changes of state of all instances of all hosts that have come since the last call, each once and in
  /// order. The first call asks for them, those that hosts keep included. Wait with wait_for_change().
  [[nodiscard]] Result<std::vector<TransitionView>> transitions();
  /// Whether transitions() has returned all that this host has told of: each status of an instance says how
  /// many changes of state there were, and those are written before it. timed_out: no complete status came.
  [[nodiscard]] Result<bool> has_all_transitions(const std::string& host, TimePoint deadline);

  /// A command and its answer. The status that this client shows afterwards has its effect.
  /// timed_out: no answer. The host begins nothing after the deadline; whether it began before is not known.
  [[nodiscard]] Result<ApiReply> call(const ApiRequest& request, TimePoint deadline);

  /// Sends an application to an instance, where it is checked, kept and loaded; the answer is that to the
  /// load. Goes on when plchost-dds ends meanwhile. `deadline`: for the host to begin; then as long as it
  /// moves. timed_out: it has not begun, or nothing has moved for 10 s.
  [[nodiscard]] Result<ApiReply> download(const Download& download, const DownloadProgressFunction& progress,
                                          TimePoint deadline);
  /// The applications that were sent to the instances of a host and are kept there.
  [[nodiscard]] Result<std::vector<plc_ApplicationStatus>> applications(const std::string& host,
                                                                        TimePoint deadline);

  /// Makes the way to a host's events, so that the first post finds it open.
  [[nodiscard]] Result<void> prepare_posts(const std::string& host, TimePoint deadline);

  /// Posts an event `count` times, `interval` apart (0: as fast as acknowledgements come), each counted
  /// exactly once, also if plchost-dds ends meanwhile. Ends early when the host has acknowledged nothing for
  /// `patience`: then the report says how many are not known. `stop` is asked at least every 50 ms; when it
  /// says true, no more are posted, and the report is about those that were.
  [[nodiscard]] Result<PostReport> post_event(const HostEvent& event, std::uint64_t count, Duration interval,
                                              Duration patience, const std::function<bool()>& stop = {});

  /// Posts an event once and waits until the tasks that are bound to it have ended their cycles for it. If
  /// the instance is starting, the event is posted once its tasks take posts. The code of the failure is the
  /// host's own: not_found: no such event, or no task is bound to it; wrong_state: a task was stopped before
  /// it ran. timed_out: nothing has come for `patience`, or the task has not run within 10 s; the post may be
  /// in the pool. unavailable: the instance was starting all the time.
  [[nodiscard]] Result<RunReport> post_and_await(const HostEvent& event, Duration patience);

  /// Posts several events, at most kMaxBatch, at once: all of them, or none. The report counts the batch as
  /// one post.
  [[nodiscard]] Result<PostReport> post_batch(const std::string& host, std::span<const EventId> events,
                                              Duration patience);

  /// One post with the least latency: one dds_write, not repeated, not waited for. prepare_posts() first. It
  /// needs no credit of the host, as nothing is kept to be repeated. The host rejects it after `patience`.
  /// After a rest, up to 26 ms earlier: a shorter `patience` is of no use. timed_out: DDS had no room within
  /// 20 ms. unavailable: 1024 other hosts were seen since this one was.
  [[nodiscard]] Result<void> post_one(const std::string& host, std::string_view instance,
                                      std::string_view event, Duration patience = kDefaultTimeout);

  /// Sleeps until something has come, wake() was called, or the deadline is there.
  void wait_for_change(TimePoint deadline) { core_->pump().round(deadline); }
  /// Ends wait_for_change(), or the next one. Any thread.
  void wake() const noexcept { core_->pump().set().wake(); }
  /// Takes what has come. The number grows when hosts() or a status that was asked for may have changed, and
  /// not with presences that tell nothing new.
  [[nodiscard]] std::uint64_t changes();
  /// When the first of the hosts that answer would be silent.
  [[nodiscard]] TimePoint next_silence() const;

 private:
  explicit ControlClient(std::unique_ptr<ClientCore> core) noexcept : core_(std::move(core)) {}

  std::unique_ptr<ClientCore> core_;
};

template <class Sample>
Result<std::vector<Sample>> ControlClient::status(const std::string& host, TimePoint deadline) {
  return wait(core_->status<Sample>(host, deadline));
}

}  // namespace plchost
