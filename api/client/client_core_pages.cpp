#include <algorithm>
#include <optional>
#include <tuple>

#include <fmt/format.h>

#include "api/client/check_names.hpp"
#include "api/client/client_core.hpp"
#include "api/client/client_core_status.hpp"
#include "api/dds/text.hpp"

namespace plchost {

namespace {

// A page that has not come so long after the answer will not: it is asked for again.
constexpr Duration kPagePatience = std::chrono::milliseconds(500);
constexpr Duration kBusyPause = std::chrono::milliseconds(50);

ApiRequest to_instance(std::string host, std::string instance, std::int32_t operation,
                       const plc_ListPart& part) {
  return {.host = std::move(host),
          .operation = operation,
          .instance = std::move(instance),
          .argument = "",
          .part = part};
}

}  // namespace

void ClientCore::take_pages(Answers which) {
  const auto take = [&]<class Page>(Pages<Page>& pages) {
    if (!wants(which, pages.from, pages.come)) return;
    dds::take_valid_told<Page, dds::kTopicOf<Page>.qos.depth>(
        pages.from.reader.get(), answering_, [&](const Page& page, const auto& /*info*/) {
          pages.come.put({page.related_identity, dds::text_of(page.host)}, [&] { return listing_of(page); });
        });
  };
  std::apply([&](auto&... pages) { (take(pages), ...); }, pages_);
}

template <class Page>
Async<Result<ListingOf<Page>>> ClientCore::ask_for_page(ApiRequest request, TimePoint deadline) {
  PLCHOST_CO_TRY(check_host_name(request.host, only_));
  PLCHOST_CO_TRY(check_api_request(request, only_));
  const dds::TopicInfo& topic = dds::kTopicOf<Page>;
  Pages<Page>& pages = std::get<Pages<Page>>(pages_);
  const dds::Qos qos = dds::answers_qos(topic, topic.qos.depth);
  PLCHOST_CO_TRY(open_own_reader<Page>(pages.from, qos));
  for (;;) {
    PLCHOST_CO_TRY_ASSIGN(auto asking, begin_asking(request));
    typename Inbox<ListingOf<Page>>::Expected page(pages.come, asking.key());
    PLCHOST_CO_TRY_ASSIGN(const auto reply, co_await ask(std::move(asking), deadline, {}));
    if (reply.code != ErrorCode::ok && reply.code != ErrorCode::busy)
      co_return failure(reply.code, reply.text);
    const TimePoint patience =
        MonotonicClock::now() + (reply.code == ErrorCode::ok ? kPagePatience : kBusyPause);
    const TimePoint until = std::min(deadline, patience);
    for (;;) {
      if (auto listing = page.take_first()) co_return *std::move(listing);
      if (MonotonicClock::now() >= until) break;
      co_await pump_->change(until);
    }
    if (MonotonicClock::now() >= deadline) break;
  }
  co_return failure(ErrorCode::timed_out,
                    fmt::format("the answer of host '{}' has not come ({})", request.host, topic.name));
}

template <class Page>
Async<Result<ListingOf<Page>>> ClientCore::list(std::string host, std::int32_t operation,
                                                Result<plc_ListPart> part, TimePoint deadline) {
  PLCHOST_CO_TRY(part);
  const ApiRequest request{
      .host = host, .operation = operation, .instance = "", .argument = "", .part = *part};
  co_return co_await ask_for_page<Page>(request, deadline);
}

Async<Result<ObjectListing>> ClientCore::list_objects(std::string host, ObjectQuery query,
                                                      TimePoint deadline) {
  return list<plc_ObjectPage>(host, plc_OPERATION_LIST_OBJECTS, part_of(query), deadline);
}

Async<Result<NodesTold>> ClientCore::list_nodes(std::string host, NodeQuery query, TimePoint deadline) {
  return list<plc_NodePage>(host, plc_OPERATION_LIST_NODES, part_of(query), deadline);
}

Async<Result<NodesTold>> ClientCore::list_routes(std::string host, NodeQuery query, TimePoint deadline) {
  return list<plc_NodePage>(host, plc_OPERATION_LIST_ROUTES, part_of(query), deadline);
}

Async<Result<LogListing>> ClientCore::read_log(std::string host, std::string instance, LogQuery query,
                                               TimePoint deadline) {
  return ask_for_page<plc_LogPage>(
      to_instance(std::move(host), std::move(instance), plc_OPERATION_READ_LOG, part_of(query)), deadline);
}

Async<Result<VariableListing>> ClientCore::list_variables(std::string host, std::string instance,
                                                          VariableQuery query, TimePoint deadline) {
  PLCHOST_CO_TRY_ASSIGN(const auto part, part_of(query));
  co_return co_await ask_for_page<plc_VariablePage>(
      to_instance(std::move(host), std::move(instance), plc_OPERATION_LIST_VARIABLES, part), deadline);
}

Async<Result<DebugPart>> ClientCore::read_debug(std::string host, std::string instance, DebugQuery query,
                                                TimePoint deadline) {
  return ask_for_page<plc_DebugPage>(
      to_instance(std::move(host), std::move(instance), plc_OPERATION_READ_DEBUG, part_of(query)), deadline);
}

Async<Result<TraceListing>> ClientCore::read_trace(std::string host, std::string instance, TraceQuery query,
                                                   TimePoint deadline) {
  return ask_for_page<plc_TracePage>(
      to_instance(std::move(host), std::move(instance), plc_OPERATION_READ_TRACE, part_of(query)), deadline);
}

}  // namespace plchost
