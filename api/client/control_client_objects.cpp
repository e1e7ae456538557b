#include <algorithm>

#include <fmt/format.h>

#include "api/client/check_names.hpp"
#include "api/client/control_client.hpp"
#include "api/dds/samples.hpp"

namespace plchost {

namespace {

// A page that has not come so long after the answer will not: it is asked for again.
constexpr Duration kPagePatience = std::chrono::milliseconds(500);
constexpr Duration kBusyPause = std::chrono::milliseconds(50);

}  // namespace

std::optional<ObjectListing> ControlClient::take_page(const plc_SampleIdentity& identity) {
  std::optional<ObjectListing> found;
  dds::take_valid<plc_ObjectPage, dds::kObjectPageDepth>(
      page_reader_.get(), [&](const plc_ObjectPage& page, const auto& /*info*/) {
        const plc_SampleIdentity& related = page.related_identity;
        const bool ours = related.sequence_number == identity.sequence_number &&
                          std::ranges::equal(related.writer_guid, identity.writer_guid);
        if (ours) found = listing_of(page);  // others answer calls that were given up
      });
  return found;
}

Result<ObjectListing> ControlClient::list_objects(const std::string& host, const ObjectQuery& query,
                                                  TimePoint deadline) {
  if (auto good = check_host_name(host); !good) return std::unexpected(std::move(good).error());
  auto entries = entries_of(query);
  if (!entries) return std::unexpected(std::move(entries).error());
  dds::Qos qos = dds::object_page_qos();
  qos.keep_all().max_samples(dds::kObjectPageDepth * dds::kMaxServersPerMachine);
  if (auto opened = open_own_reader(page_topic_, page_reader_, dds::kObjectPage, qos); !opened) {
    return std::unexpected(opened.error());
  }
  const ApiRequest request{host, plc_OPERATION_LIST_OBJECTS, "", "", *std::move(entries)};
  for (;;) {
    const auto reply = call(request, deadline);
    if (!reply) return std::unexpected(reply.error());
    if (reply->code != ErrorCode::ok && reply->code != ErrorCode::busy)
      return failure(reply->code, reply->text);
    const TimePoint patience =
        MonotonicClock::now() + (reply->code == ErrorCode::ok ? kPagePatience : kBusyPause);
    const TimePoint until = std::min(deadline, patience);
    for (;;) {
      if (auto listing = take_page(reply->identity)) return *std::move(listing);
      if (MonotonicClock::now() >= until) break;
      update();  // or what has come on other topics would keep the wait from waiting
      wait_set_.wait(until);
    }
    if (MonotonicClock::now() >= deadline) break;
  }
  return failure(ErrorCode::timed_out, fmt::format("the objects of host '{}' have not come", host));
}

}  // namespace plchost
