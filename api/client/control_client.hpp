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

#include "api/client/late_writers.hpp"
#include "api/client/own_answers.hpp"
#include "api/client/participant.hpp"
#include "api/client/poster.hpp"
#include "api/client/request_caller.hpp"
#include "api/client/seen_hosts.hpp"
#include "api/client/statistics_cache.hpp"
#include "api/client/status_cache.hpp"
#include "api/client/topic_reader.hpp"
#include "api/client/transition_log.hpp"
#include "api/client/wait_set.hpp"
#include "api/dds/domain.hpp"
#include "api/dds/log_page.hpp"
#include "api/dds/node_page.hpp"
#include "api/dds/object_page.hpp"
#include "api/dds/object_query.hpp"
#include "api/dds/topics.hpp"
#include "shm/base/result.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// One host, as it was seen last.
struct HostView {
  std::string name;
  std::uint64_t epoch = 0;
  std::int32_t server_pid = 0;    ///< of plchost-dds
  plc_HostStatus status{};        ///< but for its ext
  std::vector<plc_KeyValue> ext;  ///< of the status
  bool silent = false;            ///< it does not show its presence any more; the rest is what it said last
  bool contested = false;         ///< two servers show their presence under that name at the same time

  /// The labels of its configuration, beside its name.
  [[nodiscard]] std::vector<std::string> labels() const;
  /// The names of the schedulers that its instances can have. None: a host of an older version.
  [[nodiscard]] std::vector<std::string> schedulers() const;
};

/// How far a host's CLOCK_REALTIME is ahead of the one here, and how wrong that can be.
struct ClockOffset {
  Duration offset{};
  Duration uncertainty{};
};

/// A post that was run.
struct RunReport {
  std::uint32_t tasks = 0;  ///< that were bound
  std::string last_task;    ///< "INSTANCE/TASK" that ended its cycle last
  Duration to_start{};      ///< on the host: from the post's arrival to the start of that cycle
  Duration to_end{};        ///< and to its end
  Duration round_trip{};    ///< here: from before the post to after the news
};

/// The listing of a page: ListingOf<plc_LogPage> is a LogListing.
template <class Page>
using ListingOf = decltype(listing_of(std::declval<const Page&>()));

/// An application that is to be sent to an instance.
struct Download {
  std::string host;
  std::string instance;
  std::string name;  ///< of the file, for people
  std::span<const std::byte> contents;
  bool boot = false;    ///< it becomes the boot application
  bool online = false;  ///< it takes over while the tasks run; see kOnlineOption
};
/// Told how many bytes have arrived: again from the beginning, when plchost-dds had to be started again.
using DownloadProgressFunction = std::function<void(std::uint64_t received)>;

/// The client's end of the DDS API: sees all hosts of a domain (of names, at most SeenHosts::kMost) and
/// addresses any. One thread at a time.
/// A client for one host reads that host's partition only, so no other host sends it anything. It sees no
/// other host, and refuses to address one (invalid_argument).
/// Nothing here waits beyond the deadline it was given; deadlines are of MonotonicClock. invalid_argument, at
/// once and with nothing sent: a name that no host, instance, event or task can have, or a text too long.
class ControlClient {
 public:
  /// A host that has not shown its presence for so long is gone.
  static constexpr Duration kHostGone = kServerGone;
  /// A host is silent after so long: a little less than the deadline of its presence, so that a thread that
  /// is woken by that sees it.
  static constexpr Duration kSilent = dds::kPresenceDeadline - std::chrono::milliseconds(5);
  /// All hosts are known when none was news for so long, and none is late (LateWriters). Where packets can be
  /// lost, it is longer than it takes until each host tells again that it is there (SPDPInterval).
  static constexpr Duration kQuiet = std::chrono::milliseconds(200);
  static constexpr Duration kQuietOnNetworks = std::chrono::milliseconds(1200);

  /// With a participant of its own. `only`: it is for that one host; empty: for all.
  [[nodiscard]] static Result<std::unique_ptr<ControlClient>> connect(const dds::DomainOptions& options,
                                                                      std::string_view only = {});
  /// Beside others of this process, which have the same participant and may be on other threads.
  [[nodiscard]] static Result<std::unique_ptr<ControlClient>> connect(
      std::shared_ptr<Participant> participant, std::string_view only = {});
  /// The one host that it is for; empty: all.
  [[nodiscard]] const std::string& only() const noexcept { return only_; }
  [[nodiscard]] const std::shared_ptr<Participant>& participant() const noexcept { return participant_; }

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

  /// Whether a host that was seen does not show its presence at present: its server is dead, or hangs, or
  /// cannot be reached. Known within 100 ms, also if threads of DDS live on there; wait_for_change() returns
  /// when it begins and when it ends. A host that stays silent is gone after kHostGone.
  [[nodiscard]] bool is_silent(std::string_view host);

  /// All samples of a status topic that a host shows, complete: waits until as much has come as the host says
  /// there is. In the order that control.idl says. timed_out: not complete at the deadline. unsupported: the
  /// host is of a version that has no such topic. Defined in control_client_status.hpp.
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

  /// One post with the least latency: one dds_write, not repeated, not waited for. prepare_posts() first.
  [[nodiscard]] Result<void> post_one(const std::string& host, std::string_view instance,
                                      std::string_view event);

  /// Sleeps until something has come, wake() was called, or the deadline is there.
  void wait_for_change(TimePoint deadline) { wait_set_.wait(deadline); }
  /// Ends wait_for_change(), or the next one. Any thread.
  void wake() const noexcept { wait_set_.wake(); }
  /// Takes what has come. The number grows when hosts() or a status that was asked for may have changed, and
  /// not with presences that tell nothing new.
  [[nodiscard]] std::uint64_t changes();
  /// When the first of the hosts that answer would be silent.
  [[nodiscard]] TimePoint next_silence() const;

 private:
  ControlClient() = default;
  Result<void> open(std::shared_ptr<Participant> participant, std::string_view only);
  [[nodiscard]] dds_entity_t entity() const noexcept { return participant_->entity.get(); }
  void update();
  void update_hosts();
  [[nodiscard]] std::vector<HostView> present() const;
  [[nodiscard]] std::optional<HostView> present(std::string_view name) const;
  [[nodiscard]] std::optional<HostView> view_of(std::string_view name, const SeenHost& seen) const;
  [[nodiscard]] std::vector<dds_instance_handle_t> late_writers(const std::vector<HostView>& found);
  template <class Cache>
  [[nodiscard]] Result<void> open_cache(Cache& cache, const dds::TopicInfo& topic,
                                        std::uint32_t statuses = DDS_DATA_AVAILABLE_STATUS);
  /// Keeps answers to this client only.
  template <class Answer>
  [[nodiscard]] Result<void> open_own_reader(dds::TopicReader& answers, const dds::Qos& qos);
  [[nodiscard]] Result<dds::Entity> make_own_topic(const dds::TopicInfo& info);
  [[nodiscard]] Result<void> read_own(dds::TopicReader& answers, dds::Entity topic, const dds::Qos& qos);
  [[nodiscard]] Result<RequestCaller*> caller(const std::string& host, bool engineering);
  /// Asks, and waits for the answer. A request that was given up leaves no writer that would still send it.
  [[nodiscard]] Result<ApiReply> ask(const ApiRequest& request, TimePoint deadline,
                                     const RequestCaller::Meanwhile& meanwhile);
  /// nullptr: that host has not been seen.
  [[nodiscard]] const HostClock* clock_of(const std::string& host) const;
  [[nodiscard]] Result<RunReport> post_and_await_once(const HostEvent& event, TimePoint deadline);
  void use_clock(EventPoster& posts, const std::string& host, Duration patience) const;
  /// The way of such posts to that host.
  template <class Sample>
  [[nodiscard]] Result<Poster<Sample>*> poster(const std::string& host);
  [[nodiscard]] Result<void> prepare_runs(const std::string& host, TimePoint deadline);
  [[nodiscard]] std::optional<Result<RunReport>> take_run(const EventPoster& posts, std::string_view host,
                                                          std::uint64_t number, TimePoint start);
  bool take_acks(TimePoint now);
  /// Until the status shows the effect of what was answered.
  void await_status(const std::string& host, const ApiReply& reply, TimePoint deadline);
  static constexpr Duration kStatusPatience = std::chrono::seconds(2);
  template <class Page>
  [[nodiscard]] Result<ListingOf<Page>> ask_for_page(const ApiRequest& request, TimePoint deadline);
  template <class Page>
  [[nodiscard]] Result<ListingOf<Page>> list(const std::string& host, std::int32_t operation,
                                             const Result<plc_ListPart>& part, TimePoint deadline);

  std::shared_ptr<Participant> participant_;
  std::string only_;
  WaitSet wait_set_;
  OwnAnswers own_answers_;  // its readers end before it
  std::string partition_;
  dds::Entity own_subscriber_;
  dds::Entity status_subscriber_;
  dds::HostWriters answering_;  // of the readers in its own partition
  StatusCache<plc_Presence> presence_;
  // A host that is silent is still shown as it was.
  StatusCache<plc_HostStatus, UnseenHost::keeps_last_words> host_status_;
  template <class... Samples>
  using CachesOf = std::tuple<StatusCache<Samples>...>;
  dds::OfCountedStatus<CachesOf> status_;
  StatisticsCache statistics_;
  StatusCache<plc_HostFinding> host_findings_;
  SeenHosts seen_;
  LateWriters late_writers_;
  std::vector<int> silences_;  ///< of the hosts, by name, at the last changes(): 1 silent, 2 gone
  std::uint64_t host_changes_ = 0;
  TransitionLog transition_log_;
  TimePoint last_news_;
  TimePoint told_keys_look_;  ///< when plc_forget_told_keys() was called last
  Duration quiet_ = kQuiet;
  dds::TopicReader replies_;
  template <class Page>
  struct Pages {
    dds::TopicReader from;
  };
  std::tuple<Pages<plc_ObjectPage>, Pages<plc_NodePage>, Pages<plc_LogPage>> pages_;
  dds::TopicReader acks_;
  dds::TopicReader runs_;
  dds::TopicReader download_acks_;
  dds::Entity chunk_topic_;
  std::array<dds::Entity, 2> request_topics_;
  std::map<std::pair<std::string, bool>, RequestCaller> callers_;
  template <class Sample>
  struct Posters {
    dds::Entity topic;
    std::map<std::string, Poster<Sample>, std::less<>> of_host;
  };
  std::tuple<Posters<plc_EventPost>, Posters<plc_EventBatch>> posters_;
};

}  // namespace plchost
