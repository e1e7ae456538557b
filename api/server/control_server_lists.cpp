// The lists that a ControlServer answers by itself, from shared memory or by asking an instance.

#include <algorithm>
#include <chrono>
#include <string>
#include <utility>
#include <vector>

#include "api/dds/debug_page.hpp"
#include "api/dds/log_page.hpp"
#include "api/dds/node_page.hpp"
#include "api/dds/object_page.hpp"
#include "api/dds/object_query.hpp"
#include "api/dds/text.hpp"
#include "api/dds/trace_page.hpp"
#include "api/dds/variable_page.hpp"
#include "api/server/control_server_parts.hpp"
#include "shm/pages/debug_page.hpp"

namespace plchost {

template <class Page>
void ControlServer::Parts::send_page(const dds::Guid& client, const plc_SampleIdentity& identity,
                                     Page& page) {
  page.related_identity = identity;
  dds::copy_text(page.host, options.host);
  page.epoch = epoch;
  const bool written = sessions->write_page(client, page);
  tell(client, identity, written ? ErrorCode::ok : ErrorCode::busy,
       written ? "" : "the client does not take the page that it asked for; ask again");
}

// The page first: a client that has the answer has it, or asks again.
void ControlServer::Parts::list_objects(const dds::Guid& client, const plc_Request& request) {
  const plc_SampleIdentity& identity = request.header.request_identity;
  const auto look = [&]() -> Result<ObjectListing> {
    PLCHOST_TRY_ASSIGN(const auto query, object_query_of(request.part));
    return lister.page(query);
  };
  const auto listing = look();
  if (!listing) return tell(client, identity, listing.error().code, listing.error().describe());
  ObjectPageSample sample(*listing);
  send_page(client, request.header.request_identity, sample.page());
}

void ControlServer::Parts::list_nodes(ControlVerb verb, const dds::Guid& client, const plc_Request& request) {
  const auto look = [&]() -> Result<NodeListing> {
    PLCHOST_TRY_ASSIGN(const auto query, node_query_of(request.part));
    return verb == ControlVerb::list_nodes ? nodes.nodes(query) : nodes.routes(query);
  };
  const auto listing = look();
  if (!listing) {
    return tell(client, request.header.request_identity, listing.error().code, listing.error().describe());
  }
  NodePageSample sample(*listing);
  send_page(client, request.header.request_identity, sample.page());
}

void ControlServer::Parts::read_log(const dds::Guid& client, const plc_Request& request) {
  const auto look = [&]() -> Result<LogListing> {
    PLCHOST_TRY_ASSIGN(const auto query, log_query_of(request.part));
    return look_at_log(pool.name(), dds::text_of(request.instance), query);
  };
  const auto slice = look();
  if (!slice) {
    return tell(client, request.header.request_identity, slice.error().code, slice.error().describe());
  }
  LogPageSample sample(*slice);
  dds::copy_text(sample.page().instance, dds::text_of(request.instance));
  send_page(client, request.header.request_identity, sample.page());
}

// The instance is asked, which takes a little. Its client is told shortly before it gives up by itself.
void ControlServer::Parts::list_variables(const dds::Guid& client, const plc_Request& request) {
  const plc_SampleIdentity& identity = request.header.request_identity;
  constexpr Duration kOnTheWay = std::chrono::milliseconds(50);
  const TimePoint now = MonotonicClock::now();
  const Duration left(request.limit.clock_ns - boot_time_ns());
  const auto begun = variables->begin(
      {.client = client, .identity = identity, .instance = std::string(dds::text_of(request.instance))},
      variable_query_of(request.part), now,
      now + std::min<Duration>(left, VariableLister::kMostPatience) - kOnTheWay);
  if (!begun) tell(client, identity, begun.error().code, begun.error().describe());
}

void ControlServer::Parts::read_debug(const dds::Guid& client, const plc_Request& request) {
  const plc_SampleIdentity& identity = request.header.request_identity;
  const auto part =
      read_debug_part(pool.name(), dds::text_of(request.instance), debug_query_of(request.part));
  if (!part) return tell(client, identity, part.error().code, part.error().describe());
  DebugPageSample sample(*part);
  dds::copy_text(sample.page().instance, dds::text_of(request.instance));
  send_page(client, identity, sample.page());
}

void ControlServer::Parts::read_trace(const dds::Guid& client, const plc_Request& request) {
  const plc_SampleIdentity& identity = request.header.request_identity;
  const auto listing =
      look_at_trace(pool.name(), dds::text_of(request.instance), trace_query_of(request.part));
  if (!listing) return tell(client, identity, listing.error().code, listing.error().describe());
  TracePageSample sample(*listing);
  dds::copy_text(sample.page().instance, dds::text_of(request.instance));
  send_page(client, identity, sample.page());
}

void ControlServer::Parts::tell_variables(std::vector<VariableLister::Finished> finished) {
  for (auto& [asker, listing] : finished) {
    if (!listing) {
      tell(asker.client, asker.identity, listing.error().code, listing.error().describe());
      continue;
    }
    VariablePageSample sample(*listing);
    dds::copy_text(sample.page().instance, asker.instance);
    send_page(asker.client, asker.identity, sample.page());
  }
}

}  // namespace plchost
