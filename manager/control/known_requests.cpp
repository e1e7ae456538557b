#include "manager/control/known_requests.hpp"

#include <algorithm>
#include <utility>

namespace plchost {

namespace {

bool are_same(const ControlRequest& one, const ControlRequest& other) {
  return one.verb == other.verb && one.instance == other.instance && one.argument == other.argument;
}

}  // namespace

std::optional<KnownRequests::Earlier> KnownRequests::find(const ControlRequest& request, Asker asker) {
  const auto found = request.id.empty() ? known_.end() : known_.find(request.id);
  if (found == known_.end() || !are_same(found->second.request, request)) return std::nullopt;
  Known& known = found->second;
  if (!known.answer) known.askers.push_back(asker);
  return Earlier{known.answer};
}

void KnownRequests::begin(const ControlRequest& request, Asker asker, TimePoint now) {
  if (request.id.empty()) return;
  make_room(now);
  if (known_.size() < kMost)
    known_.insert_or_assign(request.id, Known{.request = request, .askers = {asker}});
}

std::vector<KnownRequests::Asker> KnownRequests::end(const std::string& id, Asker asker,
                                                     const ControlReply& reply, TimePoint now) {
  const auto found = id.empty() ? known_.end() : known_.find(id);
  if (found == known_.end() || found->second.answer) return {asker};
  Known& known = found->second;
  auto askers = std::move(known.askers);
  // The file of a download that has failed is gone: the next server has the client send it again.
  if (known.request.verb == ControlVerb::download_application && reply.code != ErrorCode::ok) {
    known_.erase(found);
    return askers;
  }
  known.answer = reply;
  known.answered_at = now;
  return askers;
}

void KnownRequests::make_room(TimePoint now) {
  std::erase_if(known_, [&](const auto& entry) {
    return entry.second.answer && now - entry.second.answered_at > kKept;
  });
  if (known_.size() < kMost) return;
  // One without an answer counts as the newest.
  const auto oldest = std::ranges::min_element(known_, {}, [](const auto& entry) {
    return entry.second.answer ? entry.second.answered_at : TimePoint::max();
  });
  if (oldest->second.answer) known_.erase(oldest);
}

}  // namespace plchost
