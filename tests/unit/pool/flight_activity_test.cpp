// The last entries of a flight recorder in words.
#include "shm/pages/flight_activity.hpp"

#include <set>
#include <string>
#include <vector>

#include <gmock/gmock.h>

#include "shm/base/fault_record.hpp"
#include "tests/unit/pool/unique_pool_name.hpp"

namespace plchost {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;

TimePoint time_at(std::int64_t ns) {
  return TimePoint(Duration(ns));
}

class FlightActivity : public testing::Test {
 protected:
  ~FlightActivity() override { FlightPage::remove(pool(), "line1"); }
  [[nodiscard]] const std::string& pool() const { return name_.get(); }
  [[nodiscard]] FlightPage page(const std::vector<std::string>& tasks) const {
    std::vector<FlightTask> made(tasks.size());
    for (std::size_t i = 0; i < tasks.size(); ++i) {
      made[i].name.assign(tasks[i]);
      made[i].event_mark = event_mark("line1/" + tasks[i]);
    }
    return FlightPage::create(pool(), "line1", made).value();
  }
  UniquePoolName name_;
};

TEST_F(FlightActivity, HasTheEntriesOfAllThreadsInTheOrderOfTheirTimesUntilThen) {
  FlightPage sut = page({"Fill", "Label"});
  FlightRing fill = sut.ring(kFirstTaskRing);
  FlightRing label = sut.ring(kFirstTaskRing + 1);
  FlightRing control = sut.ring(kControlRing);
  control.put(time_at(1'000'000), FlightKind::started);
  fill.put(time_at(2'003'100), FlightKind::start, 3'100);
  fill.put(time_at(2'400'000), FlightKind::posted, posted_figure(event_mark("line1/Label"), 7));
  label.put(time_at(2'500'000), FlightKind::taken, 7);
  label.put(time_at(2'500'000), FlightKind::start, 100'000);
  label.put(time_at(2'600'000), FlightKind::end, 2'000);
  control.put(time_at(3'000'000), FlightKind::fault,
              fault_figure(0, static_cast<std::uint8_t>(FaultKind::task_watchdog)));
  label.put(time_at(3'000'001), FlightKind::start, 1);
  const auto expected = ElementsAre(
      "-2.000 ms runtime: all tasks are released", "-0.997 ms Fill: start, 3.1 us after its release",
      "-0.600 ms Fill: posts the event of Label, post 7", "-0.500 ms Label: takes post 7",
      "-0.500 ms Label: start, 100.0 us after its release",
      "-0.400 ms Label: end, 2.0 us were spun before its start",
      "-0.000 ms runtime: exception, task_watchdog of Fill");
  EXPECT_THAT(activity_before(sut, time_at(3'000'000)), expected);
  const auto reader = FlightPageReader::open(pool(), "line1");
  ASSERT_TRUE(reader) << reader.error().describe();
  EXPECT_THAT(activity_before(*reader, time_at(3'000'000)), expected) << "as the manager reads it";
}

TEST_F(FlightActivity, OfAnEventThatNoTaskHasSaysSo) {
  FlightPage sut = page({"Fill"});
  sut.ring(kFirstTaskRing)
      .put(time_at(1'000), FlightKind::posted, posted_figure(event_mark("line2/Far"), 4'294'967'296 + 3));
  EXPECT_THAT(activity_before(sut, time_at(1'000)),
              ElementsAre("-0.000 ms Fill: posts an event of another instance, or of no task, post 3"));
}

TEST_F(FlightActivity, OfAFastTaskLeavesRoomForASlowOne) {
  FlightPage sut = page({"Fast", "Slow"});
  FlightRing slow = sut.ring(kFirstTaskRing + 1);
  FlightRing fast = sut.ring(kFirstTaskRing);
  slow.put(time_at(10), FlightKind::start, 5);
  for (int i = 0; i < 2'000; ++i) fast.put(time_at(1'000 + i), FlightKind::start, i);
  const auto lines = activity_before(sut, time_at(1'000'000));
  EXPECT_THAT(lines, Contains("-1.000 ms Slow: start, 0.0 us after its release"));
  EXPECT_THAT(lines, SizeIs(1 + kMostActivity / 5));
}

TEST_F(FlightActivity, OfManyTasksHasABound) {
  FlightPage sut = page(std::vector<std::string>(200, "Task"));
  for (std::size_t task = 0; task < 200; ++task) {
    FlightRing ring = sut.ring(kFirstTaskRing + task);
    for (int i = 0; i < 5; ++i) ring.put(time_at(i), FlightKind::start);
  }
  EXPECT_THAT(activity_before(sut, time_at(10)), SizeIs(kMostActivity));
}

TEST_F(FlightActivity, OfEntriesOfAStrangerHasThoseThatCanBe) {
  FlightPage sut = page({"Fill"});
  FlightRing ring = sut.ring(kFirstTaskRing);
  ring.put(time_at(INT64_MIN), FlightKind::start);
  ring.put(time_at(5), static_cast<FlightKind>(200));
  ring.put(time_at(6), FlightKind::fault, fault_figure(77, 200));
  ring.put(time_at(7), FlightKind::fault, -1);
  EXPECT_THAT(activity_before(sut, time_at(10)),
              ElementsAre("-0.000 ms Fill: exception, unknown of task 77",
                          "-0.000 ms Fill: exception, unknown of task -1"));
  EXPECT_THAT(activity_before(sut, time_at(-1)), IsEmpty());
}

// Each kind that a thread writes is told: a new one has no line here until it has words.
TEST_F(FlightActivity, HasWordsForEachKind) {
  FlightPage sut = page({"Fill"});
  FlightRing ring = sut.ring(kFirstTaskRing);
  std::size_t kinds = 0;
  for (int kind = 1; to_string(static_cast<FlightKind>(kind)) != to_string(FlightKind::none); ++kind, ++kinds)
    ring.put(time_at(kind), static_cast<FlightKind>(kind));
  const auto lines = activity_before(sut, time_at(1'000));
  EXPECT_GE(kinds, 17U);
  EXPECT_EQ(std::set<std::string>(lines.begin(), lines.end()).size(), kinds);
}

}  // namespace
}  // namespace plchost
