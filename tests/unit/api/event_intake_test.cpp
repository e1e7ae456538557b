#include "api/server/posts/event_intake.hpp"

#include <gmock/gmock.h>

#include "api/dds/text.hpp"
#include "tests/unit/api/event_intake_fixture.hpp"

namespace plchost {
namespace {

TEST_F(EventIntakeTest, PostsAndOwesOneAcknowledgementForABatch) {
  EventIntake sut = make();
  for (std::uint64_t i = 1; i <= 5; ++i) sut.process(make_post(i));
  EXPECT_EQ(event_.counted().count(), 5U);
  const auto ack = only_ack(sut);
  EXPECT_EQ(ack.epoch, 7U);
  EXPECT_EQ(ack.sequence_number, 5U);
  EXPECT_EQ(ack.accepted, 5U);
  EXPECT_EQ(ack.credits, kPostCredits);
  EXPECT_TRUE(sut.collect_acks().empty());
}

TEST_F(EventIntakeTest, AcknowledgesARepeatedPostWithoutPostingAgain) {
  EventIntake sut = make();
  sut.process(make_post(1));
  (void)sut.collect_acks();
  sut.process(make_post(1));
  EXPECT_EQ(event_.counted().count(), 1U);
  EXPECT_EQ(only_ack(sut).sequence_number, 1U);
}

TEST_F(EventIntakeTest, WaitsForAMissingPost) {
  EventIntake sut = make();
  sut.process(make_post(1));
  sut.process(make_post(3));
  EXPECT_EQ(event_.counted().count(), 1U);
  EXPECT_EQ(only_ack(sut).sequence_number, 1U);
  sut.process(make_post(2));
  sut.process(make_post(3));
  EXPECT_EQ(event_.counted().count(), 3U);
}

TEST_F(EventIntakeTest, ContinuesWhereTheServerBeforeItWasKilled) {
  {
    EventIntake before = make();
    for (std::uint64_t i = 1; i <= 3; ++i) before.process(make_post(i));
  }
  EventIntake sut = make();
  for (std::uint64_t i = 2; i <= 4; ++i) sut.process(make_post(i, 2));
  EXPECT_EQ(event_.counted().count(), 4U);
  const auto ack = only_ack(sut);
  EXPECT_EQ(ack.sequence_number, 4U);
  EXPECT_EQ(ack.accepted, 4U);
}

TEST_F(EventIntakeTest, StartsAtTheBaseOfASourceThatItDoesNotKnow) {
  EventIntake sut = make();
  sut.process(make_post(101, 100));
  EXPECT_EQ(event_.counted().count(), 0U) << "100 is not acknowledged and has not come";
  sut.process(make_post(100, 100));
  sut.process(make_post(101, 100));
  EXPECT_EQ(event_.counted().count(), 2U);
}

TEST_F(EventIntakeTest, RejectsAPostThatItsSourceHasGivenUpAndGoesOn) {
  EventIntake sut = make();
  auto late = make_post(1);
  late.limit = {.epoch = 7, .clock_ns = boot_time_ns() - 1};
  auto in_time = make_post(2);
  in_time.limit = {.epoch = 7, .clock_ns = boot_time_ns() + Duration(std::chrono::hours(1)).count()};
  sut.process(late);
  sut.process(in_time);
  EXPECT_EQ(event_.counted().count(), 1U);
  const auto ack = only_ack(sut);
  EXPECT_EQ(ack.sequence_number, 2U);
  EXPECT_EQ(ack.rejected_sequence, 1U);
  EXPECT_EQ(static_cast<ErrorCode>(ack.rejected_code), ErrorCode::timed_out);
  sut.process(late);
  EXPECT_EQ(only_ack(sut).rejected, 1U) << "it came again";
}

TEST_F(EventIntakeTest, TakesAPostByTheClockOfAnotherServerWhenItComesAgainByItsOwn) {
  EventIntake sut = make();
  auto post = make_post(1);
  post.limit = {.epoch = 6, .clock_ns = boot_time_ns() + Duration(std::chrono::hours(1)).count()};
  sut.process(post);
  EXPECT_EQ(event_.counted().count(), 0U);
  const auto ack = only_ack(sut);
  EXPECT_EQ(ack.sequence_number, 0U) << "its source learns of the new epoch";
  EXPECT_EQ(ack.rejected, 0U);
  post.limit.epoch = 7;
  sut.process(post);
  EXPECT_EQ(event_.counted().count(), 1U);
}

TEST_F(EventIntakeTest, KeepsSourcesApart) {
  EventIntake sut = make();
  sut.process(make_post(1, 1, 1));
  sut.process(make_post(1, 1, 2));
  EXPECT_EQ(event_.counted().count(), 2U);
  EXPECT_EQ(sut.collect_acks().size(), 2U);
}

TEST_F(EventIntakeTest, RejectsByNameAndGoesOn) {
  EventIntake sut = make();
  auto wrong = make_post(1);
  dds::copy_text(wrong.event, "redy");
  sut.process(wrong);
  sut.process(make_post(2));
  const auto ack = only_ack(sut);
  EXPECT_EQ(ack.sequence_number, 2U);
  EXPECT_EQ(ack.accepted, 1U);
  EXPECT_EQ(ack.rejected, 1U);
  EXPECT_EQ(ack.rejected_sequence, 1U);
  EXPECT_EQ(ack.rejected_code, static_cast<int>(ErrorCode::not_found));
  EXPECT_THAT(std::string(dds::text_of(ack.rejected_text)), testing::HasSubstr("line1/redy"));
}

TEST_F(EventIntakeTest, RejectsAnotherHostAndImpossibleNames) {
  EventIntake sut = make();
  auto host = make_post(1);
  dds::copy_text(host.host, "hostb");
  sut.process(host);
  EXPECT_THAT(std::string(dds::text_of(only_ack(sut).rejected_text)), testing::HasSubstr("hostb"));
  auto empty = make_post(2);
  dds::copy_text(empty.instance, "");
  sut.process(empty);
  auto path = make_post(3);
  dds::copy_text(path.event, "../x");
  sut.process(path);
  EXPECT_EQ(only_ack(sut).rejected, 3U);
  EXPECT_EQ(event_.counted().count(), 0U);
}

TEST_F(EventIntakeTest, AnswersImpossibleNumbersAndCountsThemApart) {
  EventIntake sut = make();
  constexpr std::uint64_t kLast = ~std::uint64_t{0};
  for (const auto& [number, base] : {std::pair<std::uint64_t, std::uint64_t>{0, 0},
                                     {1, 0},
                                     {1, 2},
                                     {kLast, 1},
                                     {kLast, kLast},
                                     {kMaxPostNumber + 1, kMaxPostNumber + 1}}) {
    sut.process(make_post(number, base));
    const auto ack = only_ack(sut);
    EXPECT_EQ(ack.rejected_sequence, number);
    EXPECT_EQ(ack.rejected_code, static_cast<int>(ErrorCode::invalid_argument));
    EXPECT_THAT(std::string(dds::text_of(ack.rejected_text)), testing::HasSubstr("sequence_number"));
    EXPECT_EQ(ack.rejected, 0U) << "it has no place among those that are numbered";
    EXPECT_EQ(ack.sequence_number, 0U);
  }
  EXPECT_EQ(sut.malformed(), 6U);
  EXPECT_EQ(sut.writers().at(1).counters.malformed, 6U);
  sut.process(make_post(1));
  EXPECT_EQ(only_ack(sut).accepted, 1U);
  EXPECT_EQ(event_.counted().count(), 1U) << "later posts are done, not only acknowledged";
}

TEST_F(EventIntakeTest, SeesThatAnEventWasUnregistered) {
  EventIntake sut = make();
  sut.process(make_post(1));
  event_.set_registered(false);
  sut.process(make_post(2));
  EXPECT_EQ(only_ack(sut).rejected, 1U);
  event_.set_registered(true);
  sut.process(make_post(3));
  EXPECT_EQ(only_ack(sut).accepted, 2U);
  EXPECT_EQ(event_.counted().count(), 2U);
}

TEST_F(EventIntakeTest, SaysWhichPostsFoundNoTask) {
  EventIntake sut = make();
  event_.set_bound_tasks(0);
  sut.process(make_post(1));
  EXPECT_EQ(only_ack(sut).no_task, 1U);
}

std::vector<std::uint64_t> figures(const PostCounters& counters) {
  return {counters.received,  counters.accepted, counters.no_task, counters.rejected,
          counters.duplicate, counters.early,    counters.lost};
}

TEST_F(EventIntakeTest, CountsForEachSourceWhatBecameOfItsPosts) {
  EventIntake sut = make();
  sut.process(make_post(1));
  sut.process(make_post(1));  // again
  sut.process(make_post(3));  // 2 is missing
  sut.process(make_post(2));
  auto unknown = make_post(3);
  dds::copy_text(unknown.event, "redy");
  sut.process(unknown);
  sut.process(make_post(8, 8));  // 4 to 7 were given up
  sut.process(make_post(1, 1, 2));

  const auto writers = sut.writers();

  ASSERT_EQ(writers.size(), 3U);
  const std::size_t first = writers[1].source.bytes[0] == 1 ? 1 : 2;
  EXPECT_EQ(writers[0].source, dds::Guid{});
  EXPECT_THAT(figures(writers[0].counters), testing::ElementsAre(7, 4, 0, 1, 1, 1, 4));
  EXPECT_THAT(figures(writers[first].counters), testing::ElementsAre(6, 3, 0, 1, 1, 1, 4));
  EXPECT_EQ(writers[first].last, 8U);
  EXPECT_THAT(figures(writers[3 - first].counters), testing::ElementsAre(1, 1, 0, 0, 0, 0, 0));
}

TEST_F(EventIntakeTest, TellsASourceWhatItHasLost) {
  EventIntake sut = make();
  sut.process(make_post(1));
  sut.process(make_post(5, 4));
  EXPECT_EQ(only_ack(sut).lost, 2U);
}

TEST_F(EventIntakeTest, DoesNotCallLostWhatCameBeforeItKnewTheSource) {
  EventIntake sut = make();
  sut.process(make_post(100, 100));
  EXPECT_EQ(only_ack(sut).lost, 0U);
}

TEST_F(EventIntakeTest, GoesOnCountingAfterTheServerWasReplaced) {
  {
    EventIntake before = make();
    before.process(make_post(1));
  }
  EventIntake sut = make();
  sut.process(make_post(2));
  EXPECT_EQ(sut.writers().at(0).counters.accepted, 2U);
}

TEST_F(EventIntakeTest, KeepsInTheTotalWhatSourcesDidThatWereForgotten) {
  PostLedger sut = PostLedger::open(pool_).value();
  for (std::uint32_t i = 0; i <= kLedgerEntries; ++i) {
    dds::Guid source;
    std::memcpy(source.bytes.data(), &i, sizeof i);
    source.bytes[15] = 1;
    sut.set(sut.entry_for(source, i), {.counters = {.received = 1}});
  }
  std::size_t known = 0;
  sut.for_each([&](const LedgerEntry&) { ++known; });
  EXPECT_EQ(known, kLedgerEntries);
  EXPECT_EQ(sut.total().received, kLedgerEntries + 1U);
}

/// A batch of the events "line1/NAME".
class Batch {
 public:
  Batch(std::uint64_t sequence, const std::vector<std::string>& events) {
    sample_.source[0] = 9;
    sample_.sequence_number = sequence;
    sample_.base_sequence = sequence;
    dds::copy_text(sample_.host, "hosta");
    for (const std::string& event : events) {
      plc_EventName& name = names_.emplace_back();
      dds::copy_text(name.instance, "line1");
      dds::copy_text(name.event, event);
    }
    sample_.events._buffer = names_.data();
    sample_.events._length = static_cast<std::uint32_t>(names_.size());
  }
  [[nodiscard]] const plc_EventBatch& sample() const { return sample_; }

 private:
  plc_EventBatch sample_{};
  std::vector<plc_EventName> names_;
};

TEST_F(EventIntakeTest, PostsAllEventsOfABatch) {
  const PoolEvent other = pool_.create_event("line1/other").value();
  other.set_registered(true);
  EventIntake sut = make();
  sut.process(Batch(1, {"ready", "other", "ready"}).sample());
  EXPECT_EQ(event_.counted().count(), 2U);
  EXPECT_EQ(other.counted().count(), 1U);
  const auto ack = only_ack(sut);
  EXPECT_EQ(ack.sequence_number, 1U);
  EXPECT_EQ(ack.accepted, 1U);
  EXPECT_EQ(ack.no_task, 1U) << "of one of them";
}

TEST_F(EventIntakeTest, PostsNoneOfABatchOfWhichOneCannotBePosted) {
  EventIntake sut = make();
  sut.process(Batch(1, {"ready", "ready", "redy"}).sample());
  EXPECT_EQ(event_.counted().count(), 0U);
  const auto ack = only_ack(sut);
  EXPECT_EQ(ack.rejected, 1U);
  EXPECT_THAT(std::string(dds::text_of(ack.rejected_text)),
              testing::AllOf(testing::HasSubstr("line1/redy"),
                             testing::HasSubstr("event number 3 of the batch of 3")));
}

TEST_F(EventIntakeTest, RejectsABatchOfNoEvents) {
  EventIntake sut = make();
  sut.process(Batch(1, {}).sample());
  EXPECT_EQ(only_ack(sut).rejected, 1U);
}

TEST_F(EventIntakeTest, DoesARepeatedBatchOnce) {
  EventIntake sut = make();
  sut.process(Batch(1, {"ready", "ready"}).sample());
  sut.process(Batch(1, {"ready", "ready"}).sample());
  EXPECT_EQ(event_.counted().count(), 2U);
}

TEST_F(EventIntakeTest, GoesOnWithinABatchWhereTheServerBeforeItWasKilled) {
  leave_first_batch_at(2);
  EventIntake sut = make();
  sut.process(Batch(1, {"ready", "ready", "ready"}).sample());
  EXPECT_EQ(event_.counted().count(), 1U);
  sut.process(Batch(2, {"ready", "ready", "ready"}).sample());
  EXPECT_EQ(event_.counted().count(), 4U);
}

TEST_F(EventIntakeTest, PostsABatchThatWasBegunToItsEndAlsoToWhatWasUnregisteredSince) {
  leave_first_batch_at(1);
  const PoolEvent other = pool_.create_event("line1/other").value();
  EventIntake sut = make();
  sut.process(Batch(1, {"ready", "ready", "other", "gone"}).sample());
  EXPECT_EQ(event_.counted().count(), 1U);
  EXPECT_EQ(other.counted().count(), 1U) << "not registered any more";
  const auto ack = only_ack(sut);
  EXPECT_EQ(ack.accepted, 1U);
  EXPECT_EQ(ack.rejected, 0U);
  EXPECT_EQ(ack.no_task, 1U);
  EXPECT_EQ(ack.sequence_number, 1U);
}

TEST_F(EventIntakeTest, TellsTheNextServersLogOfWhoPostedLast) {
  {
    make().process(make_post(1));
  }
  EventIntake sut = make();
  sut.note_sources_since(MonotonicClock::now());
  EXPECT_TRUE(sut.collect_written_acks().empty());
  sut.note_sources_since(MonotonicClock::now() - std::chrono::minutes(1));
  const auto acks = sut.collect_written_acks();
  ASSERT_EQ(acks.size(), 1U);
  EXPECT_EQ(acks[0].accepted, 1U);
}

TEST_F(EventIntakeTest, TellsTheNextServersLogNothingThatIsInIt) {
  {
    EventIntake killed = make();
    killed.process(make_post(1));
    killed.process(make_post(2));
    killed.note_recorded(dds::Guid::from(make_post(1).source), 2);
  }
  {
    EventIntake next = make();
    next.note_sources_since(MonotonicClock::now() - std::chrono::minutes(1));
    EXPECT_TRUE(next.collect_written_acks().empty());
    next.process(make_post(3));
  }
  EventIntake sut = make();
  sut.note_sources_since(MonotonicClock::now() - std::chrono::minutes(1));
  const auto acks = sut.collect_written_acks();
  ASSERT_EQ(acks.size(), 1U);
  EXPECT_EQ(acks[0].accepted, 3U);
}

TEST_F(EventIntakeTest, NotesThePostsWhoseRunsAreAwaited) {
  EventIntake sut = make();
  sut.process(make_post(1));
  auto post = make_post(2);
  post.wait_run = true;
  sut.process(post);
  const auto awaited = sut.collect_awaited();
  ASSERT_EQ(awaited.size(), 1U);
  EXPECT_EQ(awaited[0].sequence, 2U);
  ASSERT_EQ(awaited[0].targets.size(), 1U);
  EXPECT_EQ(awaited[0].targets[0].count, 2U);
  EXPECT_TRUE(sut.collect_awaited().empty());
}

TEST_F(EventIntakeTest, OwesAnAcknowledgementAlsoToASourceThatDoesNotWaitForIt) {
  EventIntake sut = make();
  auto post = make_post(1);
  post.late_ack = true;
  sut.process(post);
  EXPECT_EQ(event_.counted().count(), 1U);
  EXPECT_EQ(only_ack(sut).sequence_number, 1U);
  EXPECT_TRUE(sut.collect_acks().empty());
}

TEST_F(EventIntakeTest, GivesEachSourceThatWasAcknowledgedOnceForTheRecords) {
  EventIntake sut = make();
  sut.process(make_post(1, 1, 1));
  sut.process(make_post(1, 1, 2));
  EXPECT_TRUE(sut.collect_written_acks().empty());
  EXPECT_EQ(sut.collect_acks().size(), 2U);
  EXPECT_EQ(sut.collect_written_acks().size(), 2U);
  EXPECT_TRUE(sut.collect_written_acks().empty());
}

TEST_F(EventIntakeTest, AwaitsABoundedNumberOfRunsAndRejectsTheRest) {
  EventIntake sut = make();
  for (std::uint64_t i = 1; i <= EventIntake::kMaxAwaited + 1; ++i) {
    auto post = make_post(i);
    post.wait_run = true;
    sut.process(post);
  }
  EXPECT_EQ(event_.counted().count(), EventIntake::kMaxAwaited);
  const auto ack = only_ack(sut);
  EXPECT_EQ(ack.rejected, 1U);
  EXPECT_EQ(ack.rejected_code, static_cast<int>(ErrorCode::full));
}

TEST_F(EventIntakeTest, LooksUpEventsBeyondTheDirectorysBound) {
  EventDirectory sut(pool_);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_TRUE(sut.find("line1", "ready"));
  const auto unknown = sut.find("line1", "other");
  ASSERT_FALSE(unknown);
  EXPECT_EQ(unknown.error().code, ErrorCode::not_found);
}

TEST_F(EventIntakeTest, LedgerGivesTheOldestEntryAwayAtItsBound) {
  PostLedger sut = PostLedger::open(pool_).value();
  const auto source = [](std::uint32_t number) {
    dds::Guid guid;
    std::memcpy(guid.bytes.data(), &number, sizeof number);
    guid.bytes[15] = 1;
    return guid;
  };
  for (std::uint32_t i = 0; i < kLedgerEntries; ++i)
    sut.set(sut.entry_for(source(i), i + 10), {.last = i + 1});
  EXPECT_EQ(sut.entry_for(source(0), 1'000'000).state().last, 1U) << "there was room for all";
  EXPECT_EQ(sut.entry_for(source(kLedgerEntries), 1'000'001).state().last, 0U);
  for (std::uint32_t i = 2; i < kLedgerEntries; ++i)
    EXPECT_NE(sut.find(source(i)), nullptr) << "not the oldest";
  EXPECT_EQ(sut.entry_for(source(0), 1'000'002).state().last, 1U) << "used lately, so kept";
  EXPECT_EQ(sut.entry_for(source(1), 1'000'003).state().last, 0U) << "was the oldest";
}

TEST_F(EventIntakeTest, LedgerOfAnotherFormIsMadeAnew) {
  {
    const auto strange = MemoryFile::replace(PostLedger::file_name(name_), 4096);
    ASSERT_TRUE(strange);
    strange->bytes()[0] = std::byte{1};
  }
  EXPECT_TRUE(PostLedger::open(pool_));
}

}  // namespace
}  // namespace plchost
