#include "api/server/posts/event_intake.hpp"

#include <algorithm>
#include <span>
#include <utility>

#include <fmt/format.h>

#include "api/dds/entries.hpp"
#include "api/dds/samples.hpp"
#include "api/dds/text.hpp"
#include "api/dds/time_limit.hpp"
#include "api/dds/topics.hpp"
#include "shm/base/control_message.hpp"

namespace plchost {

using dds::text_of;

namespace {

/// The events that a post is for.
template <class Use>
void for_each_event(const plc_EventPost& post, Use use) {
  use(text_of(post.instance), text_of(post.event));
}
template <class Use>
void for_each_event(const plc_EventBatch& batch, Use use) {
  for (const plc_EventName& name : std::span(batch.events._buffer, batch.events._length)) {
    use(text_of(name.instance), text_of(name.event));
  }
}

}  // namespace

Result<EventIntake::Wanted> EventIntake::read_wanted(const dds_sequence_plc_KeyValue& ext) {
  Wanted wanted;
  if (ext._length == 0) return wanted;
  std::string wait;
  std::string ack;
  const std::array known{std::pair(dds::kWaitEntry, &wait), std::pair(dds::kAckEntry, &ack)};
  if (auto read = dds::read_entries(std::span(ext._buffer, ext._length), known); !read) {
    return std::unexpected(read.error());
  }
  const auto is = [](std::string_view entry, std::string_view value,
                     std::string_view allowed) -> Result<bool> {
    if (value.empty() || value == allowed) return !value.empty();
    return failure(ErrorCode::invalid_argument,
                   fmt::format("{} = '{}' is not valid; allowed is: {}", entry, shown(value), allowed));
  };
  const auto run = is(dds::kWaitEntry, wait, dds::kWaitForRun);
  if (!run) return std::unexpected(run.error());
  const auto late = is(dds::kAckEntry, ack, dds::kAckLate);
  if (!late) return std::unexpected(late.error());
  return Wanted{.run = *run, .late_ack = *late};
}

bool EventIntake::take_posts(dds_entity_t reader) {
  return take<plc_EventPost>(reader);
}

bool EventIntake::take_batches(dds_entity_t reader) {
  return take<plc_EventBatch>(reader);
}

void EventIntake::note_sources_since(TimePoint then) {
  const std::lock_guard lock(mutex_);
  ledger_.for_each([&](const LedgerEntry& entry) {
    if (entry.used_ns >= then.time_since_epoch().count()) written_.insert(dds::Guid{entry.source});
  });
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
    if (source_is_writer(reader, info, dds::Guid::from(post.source))) {
      process_locked(post);
    } else {
      ++malformed_;
    }
  });
  write_acks();
  return !collected_soon && cannot_wait();
}

bool EventIntake::source_is_writer(dds_entity_t reader, const dds_sample_info_t& info,
                                   const dds::Guid& source) {
  constexpr std::size_t kMaxKnown = 4096;
  auto known = writers_.find(info.publication_handle);
  if (known == writers_.end()) {
    const dds::Guid writer = dds::writer_of(reader, info);
    if (writer == dds::Guid{}) return false;
    if (writers_.size() >= kMaxKnown) writers_.clear();
    known = writers_.emplace(info.publication_handle, writer).first;
  }
  return known->second == source;
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
  if (post.base_sequence == 0 || post.base_sequence > post.sequence_number) {
    ++malformed_;
    return;
  }
  now_ = MonotonicClock::now();
  const dds::Guid source = dds::Guid::from(post.source);
  LedgerEntry& entry = ledger_.entry_for(source, now_.time_since_epoch().count());
  // The source waits for nothing before its base any more: what has not come of that is lost. A ledger that
  // does not know the source starts there.
  const std::uint64_t last = entry.last.load(std::memory_order_relaxed);
  if (last < post.base_sequence - 1) {
    if (entry.counters.received > 0) entry.counters.lost += post.base_sequence - 1 - last;
    entry.last.store(post.base_sequence - 1, std::memory_order_release);
  }
  ++entry.counters.received;
  const auto wanted = read_wanted(post.ext);
  switch (order_of(post.sequence_number, entry.last.load(std::memory_order_relaxed))) {
    case PostOrder::next:
      if (dds::timeliness(post.limit, epoch_) == dds::Timeliness::other_epoch) {
        ++entry.counters.early;  // it comes again, with the limit by this server's clock
      } else {
        post_next(post, wanted, entry);
      }
      break;
    case PostOrder::duplicate:
      ++entry.counters.duplicate;
      // The server before this one may have been asked and be gone.
      if (wanted && wanted->run) await(post);
      break;
    case PostOrder::gap:
      ++entry.counters.early;
      break;
  }
  (wanted && wanted->late_ack ? owed_late_ : owed_).insert(source);
}

template <class Post>
void EventIntake::post_next(const Post& post, const Result<Wanted>& wanted, LedgerEntry& entry) {
  auto good = wanted ? check(post) : std::unexpected(wanted.error());
  if (good && wanted->run && awaited_.size() >= kMaxAwaited) {
    good = failure(ErrorCode::full, "too many posts at once are to be told of their runs");
  }
  const auto done = good ? try_post(post, entry) : std::unexpected(good.error());
  // The post is in the pool; from here to the store is the window that PostLedger speaks of.
  entry.last.store(post.sequence_number, std::memory_order_release);
  if (done) {
    ++entry.counters.accepted;
    for_each_event(post, [&](std::string_view instance, std::string_view event) {
      posted_.note(dds::Guid::from(post.source), instance, event);
    });
    if (*done == PostResult::no_task) ++entry.counters.no_task;
    if (wanted->run) await(post);
    return;
  }
  ++entry.counters.rejected;
  entry.rejected_sequence = post.sequence_number;
  entry.rejected_code = static_cast<std::int32_t>(done.error().code);
  entry.rejected_text.assign(done.error().message);
}

template <class Post>
Result<void> EventIntake::check(const Post& post) const {
  if (auto may = guard_->check(dds::Guid::from(post.source), security::Role::operating); !may) return may;
  if (dds::timeliness(post.limit, epoch_) == dds::Timeliness::late) return check_in_time(post.limit.clock_ns);
  const auto host = text_of(post.host);
  if (host == host_) return {};
  return failure(ErrorCode::not_found, fmt::format("this is host '{}', not '{}'", host_, shown(host)));
}

Result<PoolEvent> EventIntake::event_of(std::string_view instance, std::string_view event) {
  if (auto good = check_name("instance", instance, kMaxInstanceName); !good)
    return std::unexpected(good.error());
  if (auto good = check_name("event", event, kMaxEventName); !good) return std::unexpected(good.error());
  return directory_.find(instance, event);
}

Result<PostResult> EventIntake::try_post(const plc_EventPost& post, LedgerEntry& /*entry*/) {
  const auto found = event_of(text_of(post.instance), text_of(post.event));
  if (!found) return std::unexpected(found.error());
  const PostResult done = found->post();
  if (done != PostResult::not_registered) return done;
  return failure(ErrorCode::not_found,
                 fmt::format("external event '{}/{}' is not registered", post.instance, post.event));
}

// All are looked for before the first is posted. Once that is noted, the batch is gone through to its end: by
// the next server, if need be, which begins behind the last one that was posted.
Result<PostResult> EventIntake::try_post(const plc_EventBatch& batch, LedgerEntry& entry) {
  const std::uint32_t count = batch.events._length;
  if (count == 0) return failure(ErrorCode::invalid_argument, "a batch of no events");
  if (entry.batch.load(std::memory_order_relaxed) != batch.sequence_number) {
    Result<void> good;
    std::uint32_t position = 0;
    for_each_event(batch, [&](std::string_view instance, std::string_view event) {
      ++position;
      if (!good) return;
      if (const auto found = event_of(instance, event); !found) {
        good = failure(found.error().code,
                       fmt::format("{} (event number {} of the batch of {}; none was posted)",
                                   found.error().message, position, count));
      }
    });
    if (!good) return std::unexpected(good.error());
    entry.batch_done.store(0, std::memory_order_relaxed);
    entry.batch.store(batch.sequence_number, std::memory_order_release);
  }
  auto result = PostResult::posted;
  std::uint32_t position = 0;
  std::uint32_t gone = 0;
  for_each_event(batch, [&](std::string_view instance, std::string_view event) {
    if (position++ < entry.batch_done.load(std::memory_order_relaxed)) return;
    const auto found = event_of(instance, event);
    const PostResult done = found ? found->post() : PostResult::not_registered;
    if (done == PostResult::not_registered) ++gone;
    if (done == PostResult::no_task) result = PostResult::no_task;
    entry.batch_done.store(position, std::memory_order_release);
  });
  if (gone == 0) return result;
  return failure(ErrorCode::not_found,
                 fmt::format("{} of the {} events of the batch went at that moment; the others were posted",
                             gone, count));
}

template <class Post>
void EventIntake::await(const Post& post) {
  AwaitedPost awaited{.source = dds::Guid::from(post.source),
                      .sequence = post.sequence_number,
                      .targets = {},
                      .received = now_};
  for_each_event(post, [&](std::string_view instance, std::string_view event) {
    if (const auto found = event_of(instance, event)) {
      awaited.targets.push_back({std::string(instance), std::string(event), found->counted().count()});
    }
  });
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
  ack.sequence_number = entry.last.load(std::memory_order_relaxed);
  ack.accepted = entry.counters.accepted;
  ack.no_task = entry.counters.no_task;
  ack.rejected = entry.counters.rejected;
  ack.lost = entry.counters.lost;
  ack.rejected_sequence = entry.rejected_sequence;
  ack.rejected_code = entry.rejected_code;
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
  found.front().counters.received += malformed_;
  found.front().counters.rejected += malformed_;
  ledger_.for_each([&](const LedgerEntry& entry) {
    const TimePoint used{Duration(entry.used_ns)};
    found.front().used = std::max(found.front().used, used);
    found.push_back(
        {dds::Guid{entry.source}, entry.counters, entry.last.load(std::memory_order_relaxed), used});
  });
  return found;
}

std::uint64_t EventIntake::malformed() const {
  const std::lock_guard lock(mutex_);
  return malformed_;
}

}  // namespace plchost
