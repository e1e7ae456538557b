#include "api/server/lists/variable_lister.hpp"

#include <algorithm>
#include <array>
#include <iterator>
#include <utility>

#include <fmt/format.h>
#include <sys/epoll.h>

#include "api/dds/sample_identity.hpp"
#include "shm/base/system_call.hpp"

namespace plchost {

namespace {

Error process_has_ended() {
  return {.code = ErrorCode::unavailable, .system_errno = 0, .message = "its process has ended; ask again"};
}

Result<SymbolTable> open_table(const std::string& pool, const std::string& instance) {
  auto table = SymbolTable::open(pool, instance);
  if (table || table.error().code != ErrorCode::not_found) return table;
  return failure(ErrorCode::not_found, "it has no application, or one that declares no variables");
}

Error named(Error error, const std::string& instance) {
  error.message = fmt::format("instance '{}': {}", instance, error.message);
  return error;
}

}  // namespace

Result<VariableLister> VariableLister::create(std::string pool, std::string run_directory) {
  PLCHOST_TRY_ASSIGN(const auto epoll,
                     check_errno(::epoll_create1(EPOLL_CLOEXEC), "cannot make an epoll descriptor"));
  return VariableLister(std::move(pool), std::move(run_directory), UniqueFd(epoll));
}

Result<void> VariableLister::begin(Asker asker, VariableQuery query, TimePoint now, TimePoint deadline) {
  const auto of_client = std::ranges::count_if(
      pending_, [&](const auto& entry) { return entry.second.asker.client == asker.client; });
  const auto of_instance = std::ranges::count_if(
      pending_, [&](const auto& entry) { return entry.second.asker.instance == asker.instance; });
  if (pending_.size() >= kMaxPending || of_client >= std::ptrdiff_t{kMaxPendingOfClient} ||
      of_instance >= std::ptrdiff_t{kMaxPendingOfInstance}) {
    return failure(ErrorCode::busy,
                   fmt::format("{} lists of variables are under way; ask again", pending_.size()));
  }
  Pending pending{.asker = std::move(asker),
                  .query = std::move(query),
                  .begin = now,
                  .deadline = std::min<TimePoint>(deadline, now + kMostPatience)};
  const std::uint64_t number = next_number_++;
  if (const auto asked = ask_first(pending, number); !asked)
    return std::unexpected(named(asked.error(), pending.asker.instance));
  pending_.emplace(number, std::move(pending));
  return {};
}

bool VariableLister::is_pending(const plc_SampleIdentity& identity) const {
  return std::ranges::any_of(
      pending_, [&](const auto& entry) { return same_identity(entry.second.asker.identity, identity); });
}

// Made at the first list of an instance, and again when its process was another one.
Result<void> VariableLister::connect(const std::string& instance) {
  if (peers_.contains(instance)) return {};
  PLCHOST_TRY_ASSIGN(auto table, open_table(pool_, instance));
  PLCHOST_TRY_ASSIGN(auto link, ValueLink::connect(run_directory_, instance));
  const int fd = link.fd();
  epoll_event event{.events = EPOLLIN, .data = {.fd = fd}};
  PLCHOST_TRY(
      check_errno(::epoll_ctl(epoll_.get(), EPOLL_CTL_ADD, fd, &event), "cannot watch the values socket"));
  peers_.emplace(instance, Peer{.link = std::move(link),
                                .table = std::make_shared<const SymbolTable>(std::move(table))});
  return {};
}

Result<void> VariableLister::ask_first(Pending& pending, std::uint64_t number) {
  const std::string& instance = pending.asker.instance;
  for (bool again = true;; again = false) {
    const bool known = peers_.contains(instance);
    PLCHOST_TRY(connect(instance));
    pending.table = peers_.at(instance).table;
    pending.current.reset();
    pending.forced.reset();
    if (!pending.query.forced) {
      PLCHOST_TRY(select(pending));
    }
    const auto asked = ask(pending, number, pending.query.forced ? ValueKind::forced : ValueKind::current);
    const bool ended = !asked && asked.error().code == ErrorCode::unavailable;
    if (!ended || !known || !again) return asked;
    peers_.erase(instance);
  }
}

Result<void> VariableLister::select(Pending& pending) {
  PLCHOST_TRY_ASSIGN(pending.selection,
                     pending.query.forced
                         ? select_forced(*pending.table, pending.query, pending.forced->elements)
                         : select_variables(*pending.table, pending.query));
  return {};
}

Result<void> VariableLister::ask(Pending& pending, std::uint64_t number, ValueKind kind) {
  const auto peer = peers_.find(pending.asker.instance);
  if (peer == peers_.end()) return std::unexpected(process_has_ended());
  pending.asked = kind;
  ValueRequest request{.number = number, .stream = pending.table->stream(), .kind = kind, .elements = {}};
  if (kind == ValueKind::current) request.elements = pending.selection.elements;
  return peer->second.ask(std::move(request));
}

Result<void> VariableLister::Peer::ask(ValueRequest request) {
  if (requests.empty()) {
    PLCHOST_TRY(link.send(request));
  }
  requests.push_back(std::move(request));
  return {};
}

Result<void> VariableLister::Peer::ask_next() {
  if (!requests.empty()) requests.pop_front();
  return requests.empty() ? Result<void>() : link.send(requests.front());
}

// The first one is under way: the next one waits for its reply all the same.
void VariableLister::Peer::forget(std::uint64_t number) {
  if (requests.empty()) return;
  const auto waiting = std::next(requests.begin());
  const auto gone = std::ranges::remove(waiting, requests.end(), number, &ValueRequest::number);
  requests.erase(gone.begin(), gone.end());
}

// Another application, or version, has taken over since the table was read.
Result<void> VariableLister::renew(Pending& pending, std::uint64_t number) {
  if (std::exchange(pending.renewed, true)) {
    return failure(ErrorCode::busy, "its application changes again and again; ask again");
  }
  const auto peer = peers_.find(pending.asker.instance);
  if (peer == peers_.end()) return std::unexpected(process_has_ended());
  PLCHOST_TRY_ASSIGN(auto table, open_table(pool_, pending.asker.instance));
  peer->second.table = std::make_shared<const SymbolTable>(std::move(table));
  return ask_first(pending, number);
}

// Whether there is something else to ask for. Of a whole array not all elements are shown, and any may be
// forced.
Result<bool> VariableLister::go_on(Pending& pending, std::uint64_t number) {
  if (!pending.current) {
    PLCHOST_TRY(select(pending));
    if (pending.selection.elements.empty()) return false;
    PLCHOST_TRY(ask(pending, number, ValueKind::current));
    return true;
  }
  if (pending.forced) return false;
  const auto is_array = [&](const SelectedVariable& row) {
    return !row.element && row.count < pending.table->symbols()[row.symbol].elements();
  };
  const bool any = std::ranges::any_of(pending.current->forced, [](auto forced) { return forced != 0; }) ||
                   std::ranges::any_of(pending.selection.rows, is_array);
  if (!any) return false;
  PLCHOST_TRY(ask(pending, number, ValueKind::forced));
  return true;
}

std::optional<Result<VariableAnswer>> VariableLister::take(Pending& pending, ValueReply reply) {
  using Done = Result<VariableAnswer>;
  const std::uint64_t number = reply.number;
  if (reply.code == ErrorCode::wrong_state) {
    PLCHOST_TRY(renew(pending, number));
    return std::nullopt;
  }
  if (reply.code != ErrorCode::ok) {
    return Done(failure(reply.code,
                        fmt::format("its process does not give these values ({})", to_string(reply.code))));
  }
  (pending.asked == ValueKind::forced ? pending.forced : pending.current) = std::move(reply);
  PLCHOST_TRY_ASSIGN(const bool goes_on, go_on(pending, number));
  if (goes_on) return std::nullopt;
  const ValueReply none;
  const ValueReply& current = pending.current ? *pending.current : none;
  const ValueReply& forced = pending.forced ? *pending.forced : none;
  const ValueReply& told = pending.current ? current : forced;
  return Done(VariableAnswer{.stream = pending.table->stream(),
                             .time_unix_ns = told.time_unix_ns,
                             .time_monotonic_ns = told.time_monotonic_ns,
                             .consistent = told.consistent,
                             .complete = pending.selection.complete,
                             .next_after = pending.selection.next_after,
                             .variables = records_of(*pending.table, pending.selection, current, forced)});
}

void VariableLister::drop(const std::string& instance, const Error& why, std::vector<Finished>& finished) {
  peers_.erase(instance);
  for (auto entry = pending_.begin(); entry != pending_.end();) {
    if (entry->second.asker.instance != instance) {
      ++entry;
      continue;
    }
    finished.push_back({std::move(entry->second.asker), std::unexpected(named(why, instance))});
    entry = pending_.erase(entry);
  }
}

void VariableLister::take_from(const std::string& instance, std::vector<Finished>& finished) {
  auto replies = peers_.at(instance).link.receive();
  if (!replies) {
    const bool ended = replies.error().code == ErrorCode::unavailable;
    return drop(instance, ended ? process_has_ended() : replies.error(), finished);
  }
  for (ValueReply& reply : *replies) {
    if (const auto asked = peers_.at(instance).ask_next(); !asked)
      return drop(instance, asked.error(), finished);
    const auto found = pending_.find(reply.number);
    if (found == pending_.end()) continue;  // given up meanwhile
    auto listing = take(found->second, std::move(reply));
    if (!listing) continue;
    if (!*listing) *listing = std::unexpected(named(listing->error(), instance));
    finished.push_back({std::move(found->second.asker), *std::move(listing)});
    pending_.erase(found);
  }
}

std::vector<VariableLister::Finished> VariableLister::receive() {
  std::vector<Finished> finished;
  std::array<epoll_event, 16> events{};
  const int count = ::epoll_wait(epoll_.get(), events.data(), static_cast<int>(events.size()), 0);
  for (int i = 0; i < count; ++i) {
    const int fd = events[static_cast<std::size_t>(i)].data.fd;
    const auto ready =
        std::ranges::find_if(peers_, [&](const auto& peer) { return peer.second.link.fd() == fd; });
    if (ready != peers_.end()) take_from(std::string(ready->first), finished);
  }
  return finished;
}

std::vector<VariableLister::Finished> VariableLister::expire(TimePoint now) {
  std::vector<Finished> finished;
  for (auto entry = pending_.begin(); entry != pending_.end();) {
    Pending& pending = entry->second;
    if (now < pending.deadline) {
      ++entry;
      continue;
    }
    const std::string& instance = pending.asker.instance;
    if (const auto peer = peers_.find(instance); peer != peers_.end()) peer->second.forget(entry->first);
    const auto patience = (pending.deadline - pending.begin) / std::chrono::milliseconds(1);
    Error late = named({.code = ErrorCode::timed_out,
                        .system_errno = 0,
                        .message = fmt::format("it has not answered within {} ms", patience)},
                       instance);
    finished.push_back({std::move(pending.asker), std::unexpected(std::move(late))});
    entry = pending_.erase(entry);
  }
  return finished;
}

}  // namespace plchost
