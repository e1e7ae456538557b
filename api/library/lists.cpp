// The calls of a Client that a host answers by lists, by its findings or by its clock.
#include <utility>
#include <vector>

#include "api/dds/page_sample.hpp"
#include "api/dds/sequence.hpp"
#include "api/library/calls.hpp"
#include "api/library/convert.hpp"
#include "api/library/worker.hpp"

namespace plchost {

namespace {

Client::Object object_of(const ListedObject& listed) {
  plc_ObjectRecord record = listed.record;
  dds::lend(record.references, listed.references);
  return to_public(record);
}

// The timeout of these is that of one page.

Async<Result<std::vector<Client::Object>>> list_objects(CallOrder& order, ClientCore& core, std::string host,
                                                        ObjectQuery query) {
  PLCHOST_CO_TRY_ASSIGN(const auto place, co_await order.place(core, host));
  std::vector<Client::Object> objects;
  for (bool goes_on = true; goes_on;) {
    PLCHOST_CO_TRY_ASSIGN(const auto page, co_await core.list_objects(place.host, query, order.deadline()));
    PLCHOST_CO_TRY_ASSIGN(goes_on, next_page(place.host, page, query));
    for (const ListedObject& object : page.objects) objects.push_back(object_of(object));
  }
  co_return objects;
}

Async<Result<std::vector<Client::Node>>> list_nodes(CallOrder& order, ClientCore& core, std::string host,
                                                    NodeQuery query) {
  PLCHOST_CO_TRY_ASSIGN(const auto place, co_await order.place(core, host));
  std::vector<Client::Node> nodes;
  for (bool goes_on = true; goes_on;) {
    PLCHOST_CO_TRY_ASSIGN(const auto page, co_await core.list_nodes(place.host, query, order.deadline()));
    PLCHOST_CO_TRY_ASSIGN(goes_on, next_page(place.host, page, query));
    for (const plc_NodeRecord& node : page.nodes) nodes.push_back(to_public(node));
  }
  co_return nodes;
}

Async<Result<std::vector<Client::Route>>> list_routes(CallOrder& order, ClientCore& core, std::string host,
                                                      NodeQuery query) {
  PLCHOST_CO_TRY_ASSIGN(const auto place, co_await order.place(core, host));
  std::vector<Client::Route> routes;
  for (bool goes_on = true; goes_on;) {
    PLCHOST_CO_TRY_ASSIGN(const auto page, co_await core.list_routes(place.host, query, order.deadline()));
    PLCHOST_CO_TRY_ASSIGN(goes_on, next_page(place.host, page, query));
    for (const plc_RouteRecord& route : page.routes) routes.push_back(to_public(route));
  }
  co_return routes;
}

Async<Result<Client::Clock>> clock_of_host(CallOrder& order, ClientCore& core, std::string host) {
  PLCHOST_CO_TRY_ASSIGN(const auto place, co_await order.place(core, host));
  PLCHOST_CO_TRY_ASSIGN(const auto clock, co_await core.clock_offset(place.host, place.deadline));
  co_return Client::Clock{.offset = clock.offset, .uncertainty = clock.uncertainty};
}

Async<Result<std::vector<Client::Finding>>> findings_of_host(CallOrder& order, ClientCore& core,
                                                             std::string host) {
  PLCHOST_CO_TRY_ASSIGN(const auto place, co_await order.place(core, host));
  PLCHOST_CO_TRY_ASSIGN(const auto found, co_await core.check_host(place.host, place.deadline));
  std::vector<Client::Finding> findings;
  for (const plc_HostFinding& finding : found) findings.push_back(to_public(finding));
  co_return findings;
}

}  // namespace

std::vector<Client::Object> Client::objects(const std::string& host, const std::string& pattern) {
  const ObjectQuery query{.match = pattern};
  return value_or_throw(worker_->run<std::vector<Object>>(
      [&](ClientCore& core) { return list_objects(worker_->order(), core, host, query); }));
}

std::vector<Client::Node> Client::nodes(const std::string& host, const std::string& base) {
  const NodeQuery query{.base = base};
  return value_or_throw(worker_->run<std::vector<Node>>(
      [&](ClientCore& core) { return list_nodes(worker_->order(), core, host, query); }));
}

std::vector<Client::Route> Client::routes(const std::string& host, const std::string& base) {
  const NodeQuery query{.base = base};
  return value_or_throw(worker_->run<std::vector<Route>>(
      [&](ClientCore& core) { return list_routes(worker_->order(), core, host, query); }));
}

Client::Clock Client::read_clock(const std::string& host) {
  return value_or_throw(
      worker_->run<Clock>([&](ClientCore& core) { return clock_of_host(worker_->order(), core, host); }));
}

std::vector<Client::Finding> Client::check_host(const std::string& host) {
  return value_or_throw(worker_->run<std::vector<Finding>>(
      [&](ClientCore& core) { return findings_of_host(worker_->order(), core, host); }));
}

}  // namespace plchost
