// Losses are found in the flight recorder of tasks that only seem to run.
#include "instances/runtime/tasks/loss_watch.hpp"

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/manual_clock.hpp"
#include "tests/support/own_name.hpp"

namespace plchost {
namespace {

using std::chrono::milliseconds;

class WatchOfLosses : public testing::Test {
 protected:
  static constexpr std::size_t kAbove = 0;
  static constexpr std::size_t kLoser = 1;

  WatchOfLosses() {
    for (std::size_t i = 0; i < told_.size(); ++i) {
      told_[i].iec_priority = static_cast<std::int32_t>(i);
      TaskConfig config;
      config.name = i == kAbove ? "Above" : "Loser";
      config.iec_priority = static_cast<std::int32_t>(i);
      config.interval = milliseconds(10);
      config.entry = [] {};
      told_[i].name.assign(config.name);
      configs_.push_back(config);
    }
    page_.emplace(FlightPage::create(pool_, "line1", told_).value());
    for (std::size_t i = 0; i < rings_.size(); ++i) rings_[i] = page_->ring(kFirstTaskRing + i);
    TaskEnvironment environment;
    environment.statistics = [this](std::size_t index) -> TaskStatistics& { return statistics_.at(index); };
    environment.allow_unprivileged = true;
    tasks_ = TaskSet::create(clock_, PriorityBand::normal, configs_, std::move(environment)).value();
    sut_.emplace(*page_, *tasks_, true, times_);
  }
  ~WatchOfLosses() override { FlightPage::remove(pool_, "line1"); }

  /// Times in ms from the start of the test.
  void put(std::size_t task, std::int64_t time, FlightKind kind, std::int64_t figure = 0) {
    rings_.at(task).put(start_ + milliseconds(time), kind, figure);
  }
  void lose(std::int64_t release) {
    put(kLoser, release, FlightKind::start);
    put(kLoser, release + 25, FlightKind::end);
    put(kLoser, release + 30, FlightKind::lost, 2);
  }
  // As often as it takes until one of the looks reads the record, though no task counts a loss here.
  void look(std::int64_t time) {
    for (int i = 0; i < 40; ++i) sut_->look(start_ + milliseconds(time));
  }
  [[nodiscard]] std::vector<LossRecord> losses() const {
    const FlightPageReader reader = FlightPageReader::open(pool_, "line1").value();
    std::vector<LossRecord> found;
    for (std::size_t place = 0; place < kLossesKept; ++place) {
      if (const auto loss = reader.loss(place)) found.push_back(*loss);
    }
    return found;
  }

  /// The kernel counts nothing, so the record is believed.
  class NoTimes : public ProcessorTimes {
   public:
    [[nodiscard]] Duration of_process() const noexcept override { return {}; }
    [[nodiscard]] Duration of_thread(pid_t /*thread*/) const noexcept override { return {}; }
    [[nodiscard]] Duration ready_time_of_thread(pid_t /*thread*/) const noexcept override { return {}; }
    [[nodiscard]] bool sleeps(pid_t /*thread*/) const noexcept override { return true; }
    [[nodiscard]] std::size_t real_time_threads(std::span<pid_t> /*found*/) const noexcept override {
      return 0;
    }
    [[nodiscard]] ThreadText demote(pid_t /*thread*/) const noexcept override { return {}; }
  };

  std::string pool_ = own_name("losses");
  TimePoint start_ = MonotonicClock::now();
  ManualClock clock_;
  NoTimes times_;
  std::array<FlightTask, 2> told_;
  std::vector<TaskConfig> configs_;
  std::array<TaskStatistics, 2> statistics_;
  std::optional<FlightPage> page_;
  std::unique_ptr<TaskSet> tasks_;
  std::optional<LossWatch> sut_;
  std::array<FlightRing, 2> rings_;
};

TEST_F(WatchOfLosses, ATaskThatAFaultHasStoppedHoldsNoCoreThoughNoEntryTellsOfIt) {
  put(kAbove, 0, FlightKind::start);
  ASSERT_TRUE(tasks_->task(kAbove).fault().claim());
  tasks_->task(kAbove).fault().publish();
  // By the clock of the test, as the fault has the time of the real one.
  constexpr std::int64_t kLater = 100'000;
  lose(kLater);
  look(kLater + 50);
  ASSERT_EQ(losses().size(), 1U);
  EXPECT_EQ(losses().front().cause, LossCause::long_cycle);
  EXPECT_EQ(losses().front().above_ns, 0);
}

TEST_F(WatchOfLosses, AreToldAgainAfterAStrangerHasWrittenOverTheCount) {
  lose(100);
  const MemoryFile memory =
      MemoryFile::open(flight_page_name(pool_, "line1"), 1, MemoryFile::Access::read_write).value();
  // Each word of the page that counts three entries: that of the ring.
  auto* const words = reinterpret_cast<std::uint64_t*>(memory.bytes().data());
  const std::size_t of_counts = (sizeof(FlightPageLayout) + 2 * sizeof(FlightTask)) / sizeof *words;
  std::size_t written_over = 0;
  for (std::size_t i = of_counts; i < of_counts + 64; ++i) {
    if (words[i] != 3) continue;
    words[i] = UINT64_MAX - 1;
    ++written_over;
  }
  ASSERT_EQ(written_over, 1U);
  ASSERT_EQ(page_->written(kFirstTaskRing + kLoser), UINT64_MAX - 1);
  look(200);
  const std::size_t before = losses().size();
  lose(300);
  look(350);
  std::size_t of_now = 0;
  for (const LossRecord& loss : losses()) {
    of_now += loss.release_ns == (start_ + milliseconds(300)).time_since_epoch().count();
  }
  EXPECT_EQ(of_now, 1U) << before << " told before";
}

}  // namespace
}  // namespace plchost
