#include "api/server/posts/event_intake.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "api/dds/samples.hpp"
#include "api/dds/sequence.hpp"
#include "api/dds/text.hpp"
#include "api/dds/time_limit.hpp"
#include "api/dds/topics.hpp"
#include "shm/sockets/control_message.hpp"

namespace plchost {

using dds::text_of;

namespace {

/// The source's state when its post of this number is done, one way or another.
SourceState done_with(SourceState state, std::uint64_t number) {
  ++state.counters.received;
  state.last = number;
  state.batch = state.batch_done = 0;
  state.batch_no_task = 0;
  state.last_count = state.last_taken = 0;
  return state;
}

/// The events that a post is for.
template <class Use>
void for_each_event(const plc_EventPost& post, Use use) {
  use(text_of(post.instance), text_of(post.event));
}
template <class Use>
void for_each_event(const plc_EventBatch& batch, Use use) {
  for (const plc_EventName& name : dds::parts_of(batch.events)) {
    use(text_of(name.instance), text_of(name.event));
  }
}

}  // namespace

bool EventIntake::take_posts(dds_entity_t reader) {
  return take<plc_EventPost>(reader);
}

bool EventIntake::take_batches(dds_entity_t reader) {
  return take<plc_EventBatch>(reader);
}

void EventIntake::note_sources_since(TimePoint then) {
  const std::lock_guard lock(mutex_);
  ledger_.for_each([&](const LedgerEntry& entry) {
    const bool is_told = entry.audited == static_cast<std::uint32_t>(entry.state().counters.accepted);
    if (!is_told && entry.used_ns >= then.time_since_epoch().count())
      written_.insert(dds::Guid{entry.source});
  });
}

void EventIntake::note_recorded(const dds::Guid& source, std::uint64_t accepted) {
  const std::lock_guard lock(mutex_);
  ledger_.set_audited(source, accepted);
}

void EventIntake::acknowledge_by(AckWriters& writers) {
  const std::lock_guard lock(mutex_);
  ack_writers_ = &writers;
}

template <class Post>
bool EventIntake::take(dds_entity_t reader) {
  const std::lock_guard lock(mutex_);
  const bool collected_soon = cannot_wait();
  dds::take_valid<Post>(reader, [&](const Post& post, const dds_sample_info_t& info) {
    const dds::Guid writer = writer_of(reader, info);
    if (writer == dds::Guid{}) {
      ++malformed_;  // gone meanwhile: nobody to answer
    } else if (writer == dds::Guid::from(post.source)) {
      process_locked(post);
    } else {
      refuse(writer, post.sequence_number, "the source of a post must be the GUID of its writer");
    }
  });
  write_acks();
  return !collected_soon && cannot_wait();
}

dds::Guid EventIntake::writer_of(dds_entity_t reader, const dds_sample_info_t& info) {
  constexpr std::size_t kMaxKnown = kLedgerEntries;
  auto known = writers_.find(info.publication_handle);
  if (known == writers_.end()) {
    const dds::Guid writer = dds::writer_of(reader, info);
    if (writer == dds::Guid{}) return writer;
    if (writers_.size() >= kMaxKnown) writers_.clear();
    known = writers_.emplace(info.publication_handle, writer).first;
  }
  return known->second;
}

void EventIntake::process(const plc_EventPost& post) {
  const std::lock_guard lock(mutex_);
  process_locked(post);
}

void EventIntake::process(const plc_EventBatch& batch) {
  const std::lock_guard lock(mutex_);
  process_locked(batch);
}

template <class Post>
void EventIntake::process_locked(const Post& post) {
  const dds::Guid source = dds::Guid::from(post.source);
  const std::uint64_t number = post.sequence_number;
  if (number == 0 || number > kMaxPostNumber || post.base_sequence == 0 || post.base_sequence > number) {
    return refuse(source, number,
                  fmt::format("sequence_number {}, base_sequence {}: allowed are 1 to {}, and a base that is "
                              "not greater than the number",
                              number, post.base_sequence, kMaxPostNumber));
  }
  now_ = MonotonicClock::now();
  LedgerEntry& entry = ledger_.entry_for(source, now_.time_since_epoch().count());
  SourceState state = entry.state();
  // The source waits for nothing before its base any more: posts before it that have not come are lost. A
  // ledger that does not know the source starts there.
  if (const std::uint64_t before = post.base_sequence - 1; state.last < before) {
    const bool known = state.counters.received > state.counters.malformed;
    if (known) state.counters.lost += before - state.last;
    state.last = before;
  }
  switch (order_of(number, state.last)) {
    case PostOrder::next:
      if (dds::timeliness(post.limit, epoch_) == dds::Timeliness::other_epoch) {
        ++state.counters.received;
        ++state.counters.early;  // it comes again, with the limit by this server's clock
        ledger_.set(entry, state);
      } else {
        post_next(post, entry, state);
      }
      break;
    case PostOrder::duplicate:
      ++state.counters.received;
      ++state.counters.duplicate;
      ledger_.set(entry, state);
      // The server before this one may have been asked and be gone.
      if (post.wait_run) await_again(post, entry);
      break;
    case PostOrder::gap:
      ++state.counters.received;
      ++state.counters.early;
      ledger_.set(entry, state);
      break;
  }
  (post.late_ack ? owed_late_ : owed_).insert(source);
}

// It has no place in the numbering of its writer, so that `rejected` does not count it; but it is told.
void EventIntake::refuse(const dds::Guid& writer, std::uint64_t sequence, std::string_view why) {
  ++malformed_;
  now_ = MonotonicClock::now();
  LedgerEntry& entry = ledger_.entry_for(writer, now_.time_since_epoch().count());
  SourceState state = entry.state();
  ++state.counters.received;
  ++state.counters.malformed;
  state.rejected_sequence = sequence;
  state.rejected_code = static_cast<std::int32_t>(ErrorCode::invalid_argument);
  entry.rejected_text.assign(why);
  ledger_.set(entry, state);
  owed_.insert(writer);
}

template <class Post>
void EventIntake::post_next(const Post& post, LedgerEntry& entry, const SourceState& state) {
  auto done = check(post);
  if (done && post.wait_run && awaited_.size() >= kMaxAwaited) {
    done = failure(ErrorCode::full, "too many posts wait for their runs at the same time");
  }
  Targets targets;
  if (done) done = try_post(post, entry, state, post.wait_run ? &targets : nullptr);
  if (done) {
    for_each_event(post, [&](std::string_view instance, std::string_view event) {
      posted_.note(dds::Guid::from(post.source), instance, event);
    });
    if (post.wait_run) {
      awaited_.push_back({.source = dds::Guid::from(post.source),
                          .sequence = post.sequence_number,
                          .targets = std::move(targets),
                          .received = now_});
    }
    return;
  }
  SourceState after = done_with(state, post.sequence_number);
  ++after.counters.rejected;
  after.rejected_sequence = post.sequence_number;
  after.rejected_code = static_cast<std::int32_t>(done.error().code);
  entry.rejected_text.assign(done.error().message);
  ledger_.set(entry, after);
}

template <class Post>
Result<void> EventIntake::check(const Post& post) const {
  PLCHOST_TRY(guard_->check(dds::Guid::from(post.source), security::Role::operating));
  if (dds::timeliness(post.limit, epoch_) == dds::Timeliness::late) return check_in_time(post.limit.clock_ns);
  const auto host = text_of(post.host);
  if (host == host_) return {};
  return failure(ErrorCode::not_found, fmt::format("this is host '{}', not '{}'", host_, shown(host)));
}

Result<void> EventIntake::check_names(std::string_view instance, std::string_view event) {
  PLCHOST_TRY(check_name("instance", instance, kMaxInstanceName));
  return check_name("event", event, kMaxEventName);
}

// Of the manager, even if it loses its processor meanwhile.
constexpr Duration kWriteTakes = std::chrono::seconds(1);

// An instance that is starting registers its events, and then its tasks take posts. Only after that it is
// told as running.
bool EventIntake::is_starting(std::string_view instance) {
  const bool whole = host_page_.refresh();
  const auto instances = host_page_.instances();
  const auto found = std::ranges::find(instances, instance,
                                       [](const InstanceStatus* status) { return status->name.view(); });
  // A place that was never read yet may be the one of this instance. A manager that is killed within a write
  // leaves it so until the next one is there: then that is no reason any more.
  const TimePoint now = MonotonicClock::now();
  if (whole || now - looked_ > kWriteTakes) torn_since_.reset();
  looked_ = now;
  if (!whole && !torn_since_) torn_since_ = now;
  if (!whole && host_page_.is_open() && now - *torn_since_ < kWriteTakes) return true;
  if (found == instances.end()) return false;
  const InstanceState state = (*found)->state;
  return state == InstanceState::starting || state == InstanceState::waiting;
}

// "There is no such event" and "no task was bound" are final for a client, so they are not told while an
// instance is starting: it may post again.
Result<PoolEvent> EventIntake::find(std::string_view instance, std::string_view event, bool awaited) {
  const auto there = [&](const Result<PoolEvent>& found) {
    return found && (!awaited || found->counted().snapshot().taken());
  };
  if (auto found = directory_.find(instance, event); there(found)) return found;
  if (is_starting(instance)) {
    return failure(ErrorCode::unavailable,
                   fmt::format("instance '{}' is starting: no task takes posts to '{}' yet; post it again",
                               instance, event));
  }
  return directory_.find(instance, event);  // it may have started meanwhile
}

Result<void> EventIntake::try_post(const plc_EventPost& post, LedgerEntry& entry, const SourceState& state,
                                   Targets* targets) {
  const auto instance = text_of(post.instance);
  const auto event = text_of(post.event);
  PLCHOST_TRY(check_names(instance, event));
  PLCHOST_TRY_ASSIGN(const auto found, find(instance, event, targets != nullptr));
  const auto made =
      ledger_.post(entry, found, PostLedger::Allowed::registered, [&](const CountedEvent::Snapshot& seen) {
        SourceState after = done_with(state, post.sequence_number);
        ++after.counters.accepted;
        if (!seen.taken()) ++after.counters.no_task;
        after.last_count = (seen.count() + 1) & CountedEvent::kCountMask;
        after.last_taken = seen.taken() ? 1 : 0;
        return after;
      });
  if (!made) {
    return failure(ErrorCode::not_found,
                   fmt::format("external event '{}/{}' is not registered", instance, event));
  }
  if (targets != nullptr) {
    targets->push_back({.instance = std::string(instance),
                        .event = std::string(event),
                        .count = made->count(),
                        .taken = made->taken(),
                        .handle = found});
  }
  return {};
}

// The events of a batch, so that all are found before the first is posted to. Of a batch that was begun those
// count that are there still.
Result<void> EventIntake::look_up(const plc_EventBatch& batch, bool begun, bool awaited) {
  batch_events_.clear();
  Result<void> good;
  for_each_event(batch, [&](std::string_view instance, std::string_view event) {
    if (!good) return;
    good = check_names(instance, event);
    if (!good) return;
    const auto found = begun ? directory_.find_any(instance, event) : find(instance, event, awaited);
    batch_events_.push_back(found.value_or(PoolEvent()));
    if (!found && !begun) {
      good = failure(found.error().code,
                     fmt::format("{} (event number {} of the batch of {}; none was posted)",
                                 found.error().message, batch_events_.size(), batch.events._length));
    }
  });
  return good;
}

// The batch takes effect when all of its events were found. From then on it goes through to its end, by the
// next server, if need be, which begins behind the last event that was posted. An event that is unregistered
// in between is posted nevertheless; one that has left the pool has taken its posts with it.
Result<void> EventIntake::try_post(const plc_EventBatch& batch, LedgerEntry& entry, const SourceState& state,
                                   Targets* targets) {
  const std::uint32_t count = batch.events._length;
  if (count == 0) return failure(ErrorCode::invalid_argument, "a batch of no events");
  const bool begun = state.batch == batch.sequence_number && state.batch_done > 0;
  PLCHOST_TRY(look_up(batch, begun, targets != nullptr));
  const auto finished = [&](const SourceState& part) {
    SourceState after = done_with(part, batch.sequence_number);
    ++after.counters.accepted;
    after.counters.no_task += part.batch_no_task;
    return after;
  };
  SourceState part = state;
  if (!begun) part.batch_no_task = 0;
  std::uint32_t position = 0;
  for_each_event(batch, [&](std::string_view instance, std::string_view event) {
    const std::uint32_t index = position++;
    if (begun && index < state.batch_done) return;
    const auto made = ledger_.post(entry, batch_events_[index], PostLedger::Allowed::also_unregistered,
                                   [&](const CountedEvent::Snapshot& seen) {
                                     SourceState after = part;
                                     after.batch = batch.sequence_number;
                                     after.batch_done = index + 1;
                                     if (!seen.taken()) after.batch_no_task = 1;
                                     return index + 1 < count ? after : finished(after);
                                   });
    if (!made) return;
    part = entry.state();
    if (targets != nullptr) {
      targets->push_back({.instance = std::string(instance),
                          .event = std::string(event),
                          .count = made->count(),
                          .taken = made->taken(),
                          .handle = batch_events_[index]});
    }
  });
  if (part.last != batch.sequence_number) ledger_.set(entry, finished(part));
  return {};
}

// Of a post that was done before: by the last one of its source it is known what the event's count was, or
// why it was rejected. The client may read this before the acknowledgement: both tell the same.
template <class Post>
void EventIntake::await_again(const Post& post, const LedgerEntry& entry) {
  const SourceState& state = entry.state();
  AwaitedPost awaited{.source = dds::Guid::from(post.source),
                      .sequence = post.sequence_number,
                      .targets = {},
                      .received = now_};
  const bool exact = state.last == post.sequence_number && state.last_count != 0;
  for_each_event(post, [&](std::string_view instance, std::string_view event) {
    const auto found = directory_.find_any(instance, event);
    if (!found) {
      awaited.unrun = {.code = ErrorCode::not_found,
                       .system_errno = 0,
                       .message = fmt::format("whether a task has run for the post is not known: {}",
                                              found.error().message)};
      return;
    }
    awaited.targets.push_back({.instance = std::string(instance),
                               .event = std::string(event),
                               .count = exact ? state.last_count : found->counted().count(),
                               .taken = !exact || state.last_taken != 0,
                               .exact = exact,
                               .handle = *found});
  });
  if (state.rejected_sequence == post.sequence_number) {
    awaited.unrun = {.code = static_cast<ErrorCode>(state.rejected_code),
                     .system_errno = 0,
                     .message = std::string(entry.rejected_text.view())};
  }
  if (awaited_.size() < kMaxAwaited) awaited_.push_back(std::move(awaited));
}

std::vector<AwaitedPost> EventIntake::collect_awaited() {
  const std::lock_guard lock(mutex_);
  return std::exchange(awaited_, {});
}

// Those that have no writer yet are left for the control loop, which makes it.
void EventIntake::write_acks() {
  if (ack_writers_ == nullptr) return;
  std::erase_if(owed_, [this](const dds::Guid& source) {
    const LedgerEntry* const entry = ledger_.find(source);
    if (entry == nullptr || !ack_writers_->write(source.participant(), make_ack(*entry))) return false;
    owed_late_.erase(source);
    written_.insert(source);
    return true;
  });
}

plc_EventAck EventIntake::make_ack(const LedgerEntry& entry) const {
  plc_EventAck ack{};
  dds::Guid{entry.source}.copy_to(ack.source);
  dds::copy_text(ack.host, host_);
  ack.epoch = epoch_;
  const SourceState& state = entry.state();
  ack.sequence_number = state.last;
  ack.accepted = state.counters.accepted;
  ack.no_task = state.counters.no_task;
  ack.rejected = state.counters.rejected;
  ack.lost = state.counters.lost;
  ack.rejected_sequence = state.rejected_sequence;
  ack.rejected_code = state.rejected_code;
  dds::copy_text(ack.rejected_text, entry.rejected_text.view());
  ack.credits = kPostCredits;
  return ack;
}

std::vector<plc_EventAck> EventIntake::make_acks(const Sources& sources) const {
  std::vector<plc_EventAck> acks;
  acks.reserve(sources.size());
  for (const dds::Guid& source : sources) {
    if (const LedgerEntry* const entry = ledger_.find(source)) acks.push_back(make_ack(*entry));
  }
  return acks;
}

std::vector<plc_EventAck> EventIntake::collect_acks() {
  const std::lock_guard lock(mutex_);
  owed_.merge(std::exchange(owed_late_, {}));
  auto acks = make_acks(owed_);
  written_.merge(std::exchange(owed_, {}));
  return acks;
}

std::vector<plc_EventAck> EventIntake::collect_written_acks() {
  const std::lock_guard lock(mutex_);
  return make_acks(std::exchange(written_, {}));
}

PostedEvents::BySource EventIntake::collect_posted() {
  const std::lock_guard lock(mutex_);
  return posted_.take();
}

std::vector<EventIntake::Writer> EventIntake::writers() const {
  const std::lock_guard lock(mutex_);
  std::vector<Writer> found{{.source = {}, .counters = ledger_.total(), .last = 0, .used = {}}};
  ledger_.for_each([&](const LedgerEntry& entry) {
    const TimePoint used{Duration(entry.used_ns)};
    found.front().used = std::max(found.front().used, used);
    found.push_back({dds::Guid{entry.source}, entry.state().counters, entry.state().last, used});
  });
  return found;
}

std::uint64_t EventIntake::malformed() const {
  const std::lock_guard lock(mutex_);
  return malformed_;
}

}  // namespace plchost
