// Entries of flight recorders, told to plcctl in pages and written as a trace.
#include <atomic>
#include <fstream>
#include <iterator>
#include <thread>

#include <gmock/gmock.h>
#include <unistd.h>

#include "shm/base/time.hpp"
#include "shm/pages/flight_page.hpp"
#include "tests/integration/api/test_host.hpp"
#include "tests/support/decoded_trace.hpp"
#include "tests/support/own_name.hpp"

namespace plchost {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

/// The recorders of two instances: a task of the first one posts, one of the second runs for that.
class RemoteTrace : public testing::Test {
 protected:
  RemoteTrace() {
    host_.write_instance(0, "line1", InstanceState::running, 4711);
    host_.write_instance(1, "line2", InstanceState::running, 4712);
    host_.write_instance(2, "line3", InstanceState::offline);
    host_.write_count(3);
    (void)host_.add_event("line2", "go");
    host_.start_server();
  }
  ~RemoteTrace() override {
    FlightPage::remove(host_.pool_name(), "line1");
    FlightPage::remove(host_.pool_name(), "line2");
    ::unlink(file_.c_str());
  }
  [[nodiscard]] FlightPage page(const char* instance, const char* task, const char* event = nullptr) const {
    FlightTask made{.name = {}, .iec_priority = 3, .event_mark = event == nullptr ? 0 : event_mark(event)};
    made.name.assign(task);
    return FlightPage::create(host_.pool_name(), instance, {&made, 1}).value();
  }
  [[nodiscard]] RunResult record(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), {"record", "trace", "--file", file_});
    return run_plcctl(domain_.number(), std::move(arguments));
  }
  [[nodiscard]] DecodedTrace trace() const {
    std::ifstream file(file_, std::ios::binary);
    return decode(std::string(std::istreambuf_iterator<char>(file), {}));
  }
  /// Each 5 ms a cycle that posts, and one for that.
  void run_tasks(FlightPage& poster, FlightPage& taker, const std::atomic<bool>& ends) const {
    FlightRing first = poster.ring(kFirstTaskRing);
    FlightRing second = taker.ring(kFirstTaskRing);
    for (std::uint32_t count = 1; !ends; ++count) {
      std::this_thread::sleep_for(5ms);
      first.put(MonotonicClock::now(), FlightKind::start, 10);
      const TimePoint posted = MonotonicClock::now();
      first.put(posted, FlightKind::posted, posted_figure(event_mark("line2/go"), count));
      first.put(MonotonicClock::now(), FlightKind::end);
      const TimePoint start = MonotonicClock::now();
      second.put(start, FlightKind::taken, count);
      second.put(start, FlightKind::start, (start - posted).count());
      second.put(MonotonicClock::now(), FlightKind::end);
    }
  }

  OwnDomain domain_;
  TestHost host_{domain_, "hosta"};
  std::string file_ = "/tmp/" + own_name("trace");
};

TEST_F(RemoteTrace, HasTheCyclesOfAllInstancesAndArrowsFromPosts) {
  FlightPage line1 = page("line1", "Poster");
  FlightPage line2 = page("line2", "Taker", "line2/go");
  std::atomic<bool> ends{false};
  std::thread tasks([&] { run_tasks(line1, line2, ends); });
  const RunResult said = record({"all", "--duration", "1200ms"});
  ends = true;
  tasks.join();
  ASSERT_EQ(said.code, 0) << said.errors;
  EXPECT_THAT(said.output, HasSubstr(" from a post to its cycle in " + file_));
  EXPECT_THAT(said.errors, HasSubstr("plcctl: the clock of host 'hosta' is "));
  const DecodedTrace sut = trace();
  ASSERT_EQ(sut.errors, "");
  std::size_t flows = 0;
  const auto cycles = sut.on("hosta/line2/Taker");
  for (const auto& posted : sut.on("hosta/line1/Poster")) {
    if (posted.name != "posted line2/go") continue;
    const auto cycle = std::ranges::find(cycles, posted.flows, &DecodedTrace::Event::flows);
    if (cycle == cycles.end()) continue;
    ++flows;
    EXPECT_LE(posted.time, cycle->time);
    EXPECT_EQ(cycle->name, "cycle");
  }
  EXPECT_GE(flows, 20U);
  EXPECT_FALSE(sut.on("hosta/event line2/go").empty());
  EXPECT_TRUE(sut.on("hosta/line3").empty());
}

TEST_F(RemoteTrace, TellsOfEntriesThatWereWrittenOver) {
  FlightPage line1 = page("line1", "Poster");
  std::atomic<bool> ends{false};
  std::thread task([&] {
    FlightRing ring = line1.ring(kFirstTaskRing);
    while (!ends) {
      for (int i = 0; i < 6000; ++i) ring.put(MonotonicClock::now(), FlightKind::start);
      std::this_thread::sleep_for(50ms);
    }
  });
  const RunResult said = record({"line1", "--duration", "600ms"});
  ends = true;
  task.join();
  ASSERT_EQ(said.code, 0) << said.errors;
  EXPECT_THAT(said.errors, HasSubstr(" entries are missing: they were written over"));
  EXPECT_EQ(trace().errors, "");
}

TEST_F(RemoteTrace, OfAStrangerIsAFileThatCanBeRead) {
  FlightPage line1 = page("line1", "Poster");
  std::atomic<bool> ends{false};
  std::thread stranger([&] {
    FlightRing ring = line1.ring(kFirstTaskRing);
    for (std::int64_t i = 0; !ends; ++i) {
      const TimePoint now = MonotonicClock::now();
      for (const TimePoint time :
           {now, TimePoint(Duration(-i)), TimePoint::max(), TimePoint::min(), now + 1h}) {
        for (unsigned kind = 0; kind < 256; kind += 7)
          ring.put(time, static_cast<FlightKind>(kind), i - (1L << 62));
      }
      std::this_thread::sleep_for(1ms);
    }
  });
  const RunResult said = record({"line1", "--duration", "600ms"});
  ends = true;
  stranger.join();
  ASSERT_EQ(said.code, 0) << said.errors;
  EXPECT_EQ(trace().errors, "");
}

TEST_F(RemoteTrace, OfNoInstanceIsRefusedAndMakesNoFile) {
  const RunResult unknown = record({"line4", "-d", "1s"});
  EXPECT_EQ(unknown.code, 1);
  EXPECT_THAT(unknown.errors, HasSubstr("no instance 'line4'"));
  EXPECT_NE(::access(file_.c_str(), F_OK), 0);
  for (const char* const wrong : {"0s", "-1s", "2h", "5x", "nan", "inf"})
    EXPECT_THAT(record({"line1", "--duration=" + std::string(wrong)}).errors, HasSubstr("allowed are 5s"))
        << wrong;
}

}  // namespace
}  // namespace plchost
