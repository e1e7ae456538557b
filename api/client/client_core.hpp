#pragma once

#include <array>
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

#include "api/client/async.hpp"
#include "api/client/client_types.hpp"
#include "api/client/inbox.hpp"
#include "api/client/late_writers.hpp"
#include "api/client/own_answers.hpp"
#include "api/client/participant.hpp"
#include "api/client/poster.hpp"
#include "api/client/pump.hpp"
#include "api/client/request_caller.hpp"
#include "api/client/seen_hosts.hpp"
#include "api/client/statistics_cache.hpp"
#include "api/client/status_cache.hpp"
#include "api/client/topic_reader.hpp"
#include "api/client/transition_log.hpp"
#include "api/client/turns.hpp"
#include "api/dds/domain.hpp"
#include "api/dds/object_query.hpp"
#include "api/dds/topics.hpp"
#include "shm/base/result.hpp"
#include "shm/base/time.hpp"
#include "shm/operations/operations.hpp"

namespace plchost {

/// The client's end of the DDS API, asynchronous: any number of calls are under way at the same time. They
/// run on the thread that drives its pump(). plcctl and the client library are made of it. ControlClient
/// waits for one call after the other, and its comments describe each call. Posts to one host go one call
/// after the other, in the order in which the calls began. All else goes at the same time. Operations end
/// before their ClientCore.
class ClientCore {
 public:
  static constexpr Duration kHostGone = kServerGone;
  static constexpr Duration kSilent = dds::kPresenceDeadline - std::chrono::milliseconds(5);
  static constexpr Duration kQuiet = std::chrono::milliseconds(200);
  static constexpr Duration kQuietOnNetworks = std::chrono::milliseconds(1200);

  [[nodiscard]] static Result<std::unique_ptr<ClientCore>> connect(std::shared_ptr<Participant> participant,
                                                                   std::string_view only);
  [[nodiscard]] const std::string& only() const noexcept { return only_; }
  [[nodiscard]] const std::shared_ptr<Participant>& participant() const noexcept { return participant_; }
  [[nodiscard]] Pump& pump() noexcept { return *pump_; }

  Async<std::vector<HostView>> hosts(TimePoint deadline);
  Async<std::vector<HostView>> known_hosts(TimePoint deadline);
  Async<Result<ClockOffset>> clock_offset(std::string host, TimePoint deadline);
  Async<Result<HostView>> host(std::string name, TimePoint deadline);

  /// Defined in client_core_status.hpp.
  template <class Sample>
  Async<Result<std::vector<Sample>>> status(std::string host, TimePoint deadline);
  Async<Result<StatisticsReport>> statistics(std::string host, std::string instance, std::string task,
                                             TimePoint deadline);
  Async<Result<ObjectListing>> list_objects(std::string host, ObjectQuery query, TimePoint deadline);
  Async<Result<NodesTold>> list_nodes(std::string host, NodeQuery query, TimePoint deadline);
  Async<Result<NodesTold>> list_routes(std::string host, NodeQuery query, TimePoint deadline);
  Async<Result<LogListing>> read_log(std::string host, std::string instance, LogQuery query,
                                     TimePoint deadline);
  Async<Result<VariableListing>> list_variables(std::string host, std::string instance, VariableQuery query,
                                                TimePoint deadline);
  Async<Result<DebugPart>> read_debug(std::string host, std::string instance, DebugQuery query,
                                      TimePoint deadline);
  Async<Result<TraceListing>> read_trace(std::string host, std::string instance, TraceQuery query,
                                         TimePoint deadline);
  Async<Result<std::vector<plc_HostFinding>>> check_host(std::string host, TimePoint deadline);
  Async<Result<bool>> has_all_transitions(std::string host, TimePoint deadline);

  Async<Result<ApiReply>> call(ApiRequest request, TimePoint deadline);
  Async<Result<ApiReply>> download(Download download, DownloadProgressFunction progress, TimePoint deadline);

  Async<Result<void>> prepare_posts(std::string host, TimePoint deadline);
  Async<Result<PostReport>> post_event(HostEvent event, std::uint64_t count, Duration interval,
                                       Duration patience, std::function<bool()> stop = {});
  Async<Result<RunReport>> post_and_await(HostEvent event, Duration patience);
  Async<Result<PostReport>> post_batch(std::string host, std::vector<EventId> events, Duration patience);

  // These wait for nothing.

  [[nodiscard]] Result<void> post_one(const std::string& host, std::string_view instance,
                                      std::string_view event, Duration patience);
  [[nodiscard]] Result<std::vector<TransitionView>> transitions();
  [[nodiscard]] bool is_silent(std::string_view host);
  [[nodiscard]] std::uint64_t changes();
  [[nodiscard]] TimePoint next_silence() const;

 private:
  /// One request, and the caller that it goes through: it stays until the last of its requests is answered or
  /// given up.
  struct Asking {
    std::shared_ptr<RequestCaller> caller;
    std::unique_ptr<plc_Request> request;
    [[nodiscard]] AnswerKey key() const;
  };

  ClientCore() = default;
  Result<void> open(std::shared_ptr<Participant> participant, std::string_view only);
  [[nodiscard]] dds_entity_t entity() const noexcept { return participant_->entity.get(); }
  /// Takes what has come, for all operations. `several` of them wait: more than acknowledgements may be
  /// waited for.
  void take(bool several);
  /// The same, outside of a round of the pump: before the first wait of an operation.
  void look();
  void update();
  void update_hosts();
  enum class Answers : std::uint8_t { expected, all };
  void take_answers(Answers which);
  [[nodiscard]] static bool wants(Answers which, const dds::TopicReader& from, const auto& inbox) {
    return from && (which == Answers::all || inbox.expects_any());
  }
  void take_replies();
  template <class Page>
  struct Pages {
    dds::TopicReader from;
    Inbox<ListingOf<Page>> come;
  };
  void take_pages(Answers which);
  void take_runs();
  void take_download_acks();
  bool take_acks(TimePoint now);
  [[nodiscard]] std::vector<HostView> present() const;
  [[nodiscard]] std::optional<HostView> present(std::string_view name) const;
  [[nodiscard]] std::optional<HostView> view_of(std::string_view name, const SeenHost& seen) const;
  [[nodiscard]] std::vector<dds_instance_handle_t> late_writers(const std::vector<HostView>& found);
  template <class Cache>
  [[nodiscard]] Result<void> open_cache(Cache& cache, const dds::TopicInfo& topic, const dds::Qos& qos,
                                        std::uint32_t statuses);
  template <class Cache>
  [[nodiscard]] Result<void> open_cache(Cache& cache, const dds::TopicInfo& topic);
  /// Keeps answers to this client only.
  template <class Answer>
  [[nodiscard]] Result<void> open_own_reader(dds::TopicReader& answers, const dds::Qos& qos);
  [[nodiscard]] Result<dds::Entity> make_own_topic(const dds::TopicInfo& info);
  [[nodiscard]] Result<void> read_own(dds::TopicReader& answers, dds::Entity topic, const dds::Qos& qos);
  [[nodiscard]] Result<std::shared_ptr<RequestCaller>> caller(const std::string& host, ApiRole role);
  [[nodiscard]] Result<Asking> begin_asking(const ApiRequest& request);
  /// How long it goes on waiting for the answer.
  struct Wait {
    TimePoint next = TimePoint::max();  ///< there is something to do meanwhile
    TimePoint deadline;
  };
  /// The work while the answer is waited for: called whenever something may have changed.
  using Meanwhile = std::function<Wait(TimePoint now)>;
  /// Writes it, repeats it under the same identity, and waits for the answer. timed_out: none until the
  /// deadline, which `meanwhile` can move. A request that was given up leaves no writer that would still send
  /// it.
  Async<Result<ApiReply>> ask(Asking asking, TimePoint deadline, Meanwhile meanwhile);
  void give_up(const Asking& asking);
  /// nullptr: that host has not been seen.
  [[nodiscard]] const HostClock* clock_of(const std::string& host) const;
  Async<Result<RunReport>> post_and_await_once(HostEvent event, TimePoint deadline);
  void use_clock(EventPoster& posts, const std::string& host, Duration patience) const;
  /// The way of such posts to that host.
  template <class Sample>
  [[nodiscard]] Result<Poster<Sample>*> poster(const std::string& host);
  Async<Result<void>> prepare_runs(std::string host, TimePoint deadline);
  /// Waits for the turn of a call that posts to that host. nullptr: it has not come at the deadline.
  Async<std::unique_ptr<Turns::Turn>> turn_to_post(std::string host, TimePoint deadline);
  /// Until the status shows the effect of what was answered.
  Async<Result<void>> await_status(std::string host, std::uint64_t round, TimePoint deadline);
  static constexpr Duration kStatusPatience = std::chrono::seconds(2);
  template <class Page>
  Async<Result<ListingOf<Page>>> ask_for_page(ApiRequest request, TimePoint deadline);
  template <class Page>
  Async<Result<ListingOf<Page>>> list(std::string host, std::int32_t operation, Result<plc_ListPart> part,
                                      TimePoint deadline);

  std::shared_ptr<Participant> participant_;
  std::string only_;
  std::unique_ptr<Pump> pump_;
  OwnAnswers own_answers_;  // its readers end before it, and so do callers
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
  TimePoint hosts_look_;      ///< when update_hosts() was called last
  TimePoint told_keys_look_;  ///< when plc_forget_told_keys() was called last
  Duration quiet_ = kQuiet;
  dds::TopicReader replies_;
  Inbox<ApiReply> replied_;
  std::tuple<Pages<plc_ObjectPage>, Pages<plc_NodePage>, Pages<plc_LogPage>, Pages<plc_VariablePage>,
             Pages<plc_DebugPage>, Pages<plc_TracePage>>
      pages_;
  dds::TopicReader acks_;
  dds::TopicReader runs_;
  Inbox<Result<RunReport>> run_;
  dds::TopicReader download_acks_;
  Inbox<plc_DownloadAck> downloaded_;
  dds::Entity chunk_topic_;
  std::array<dds::Entity, 3> request_topics_;  // by ApiRole
  std::map<std::pair<std::string, ApiRole>, std::shared_ptr<RequestCaller>> callers_;
  template <class Sample>
  struct Posters {
    dds::Entity topic;
    std::map<std::string, Poster<Sample>, std::less<>> of_host;
  };
  std::tuple<Posters<plc_EventPost>, Posters<plc_EventBatch>> posters_;
  std::map<std::string, Turns> posting_;
};

extern template Result<EventPoster*> ClientCore::poster<plc_EventPost>(const std::string& host);

}  // namespace plchost
