// Variables by the client library: a real plc-instance runs them, behind a real plchost-dds.
#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <csignal>
#include <fstream>
#include <future>
#include <mutex>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gmock/gmock.h>
#include <unistd.h>

#include "shm/threads/thread.hpp"
#include "tests/integration/api/client_library.hpp"

namespace plchost {
namespace {

using std::chrono::milliseconds;
using testing::ElementsAre;
using testing::HasSubstr;

/// The samples that a watch has told.
class Told {
 public:
  [[nodiscard]] auto callback() {
    return [this](const Client::Sampled& sampled) {
      const std::lock_guard lock(mutex_);
      all_.push_back(sampled);
      times_.push_back(MonotonicClock::now());
      changed_.notify_all();
    };
  }
  [[nodiscard]] bool until(std::size_t count) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, kPatience, [&] { return all_.size() >= count; });
  }
  [[nodiscard]] std::vector<Client::Sampled> all() {
    const std::lock_guard lock(mutex_);
    return all_;
  }
  /// From the first to the last one.
  [[nodiscard]] Duration length() {
    const std::lock_guard lock(mutex_);
    return times_.back() - times_.front();
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<Client::Sampled> all_;
  std::vector<TimePoint> times_;
};

std::string contents_of(const std::string& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream rest(text);
  for (std::string line; std::getline(rest, line);) lines.push_back(line);
  return lines;
}

/// Of a line of a recording, behind its time and `consistent`.
std::string values_in(std::string line) {
  for (int i = 0; i < 3; ++i) line.erase(0, line.find(',') + 1);
  return line;
}

/// Its line1 runs the application line_variables.
class ClientVariables : public ClientLibrary {
 protected:
  ClientVariables()
      : process_(PLC_INSTANCE, {"--name", "line1", "--pool", host_.pool_name(), "--run-directory",
                                host_.run_directory(), "--log-level", "error", "--core",
                                fmt::format("{}", fmt::join(allowed_cores(0).value(), ",")), "--application",
                                LINE_VARIABLES_APPLICATION}) {
    host_.forwards = true;
    host_.write_instance(0, "line1", InstanceState::running, process_.pid());
    EXPECT_TRUE(eventually([&] { return value("line.total") == "21"; })) << "it does not run";
  }
  ~ClientVariables() override {
    process_.signal(SIGTERM);
    EXPECT_EQ(process_.wait(), 0);
  }

  /// Empty: it cannot be read.
  [[nodiscard]] std::string value(const std::string& name) {
    try {
      return sut_.sample("hosta", "line1", {name}).variables.front().value;
    } catch (const ClientError&) {
      return {};
    }
  }
  template <class Condition>
  [[nodiscard]] static bool eventually(Condition is_so) {
    for (const TimePoint end = soon(); MonotonicClock::now() < end; ::usleep(5000)) {
      if (is_so()) return true;
    }
    return false;
  }
  [[nodiscard]] std::vector<std::string> forces(const std::string& instance = {}) {
    std::vector<std::string> all;
    for (const Client::Force& force : sut_.forces("hosta", instance)) {
      EXPECT_TRUE(force.forced);
      all.push_back(fmt::format("{}/{} {}={}", force.host, force.instance, force.name, force.forced_value));
    }
    return all;
  }

  Client sut_{options()};
  Child process_;
};

TEST_F(ClientVariables, AreListedReadAndWritten) {
  std::vector<std::string> names;
  for (const Client::Variable& variable : sut_.variables("hosta", "line1", {"line.*"}))
    names.push_back(variable.name + " " + variable.type);
  EXPECT_THAT(names, ElementsAre("line.label STRING[15]", "line.setpoint INT", "line.stopped BOOL",
                                 "line.total DINT"));
  EXPECT_THAT(sut_.write_variable("hosta", "line1", "line.setpoint", "40"), HasSubstr("20 -> 40"));
  EXPECT_TRUE(eventually([&] { return value("line.total") == "41"; }));
  sut_.write_variable({}, "line1", "line.label", "'a=b'");
  EXPECT_EQ(value("line.label"), "'a=b'");
  sut_.write_variable("hosta", "line1", "grid[2,1]", "-7");
  EXPECT_EQ(value("grid[2,1]"), "-7");
}

TEST_F(ClientVariables, AreReadAndWrittenWholeUpToTheLongestString) {
  std::string whole = "'" + std::string(251, 'a') + "$'$$z'";  // 254 characters
  EXPECT_THAT(sut_.write_variable("hosta", "line1", "note", whole), HasSubstr("..."));
  EXPECT_EQ(value("note"), whole);
  whole[1] = 'b';
  sut_.force_variable("hosta", "line1", "note", whole);
  EXPECT_EQ(value("note"), whole);
  EXPECT_THAT(forces(), ElementsAre("hosta/line1 note=" + whole));
  const auto refusal = [&](std::size_t characters) {
    return error_of(
        [&] { sut_.write_variable("hosta", "line1", "note", "'" + std::string(characters, 'a') + "'"); });
  };
  const ClientError too_long = refusal(255);
  EXPECT_EQ(too_long.code(), ClientError::invalid_argument);
  EXPECT_THAT(too_long.what(), HasSubstr("a text of at most 254 bytes; this one has 255"));
  const ClientError no_room = refusal(2000);
  EXPECT_EQ(no_room.code(), ClientError::invalid_argument);
  EXPECT_THAT(no_room.what(), HasSubstr("of 2007 bytes: allowed are up to 1535"));
  EXPECT_EQ(value("note"), whole);
}

TEST_F(ClientVariables, AreForcedAndUnforced) {
  EXPECT_THAT(forces(), ElementsAre());
  sut_.force_variable("hosta", "line1", "line.total", "7");
  sut_.force_variable("hosta", "line1", "grid[1,1]", "99");
  EXPECT_THAT(forces(), ElementsAre("hosta/line1 grid[1,1]=99", "hosta/line1 line.total=7"));
  EXPECT_EQ(forces("line1"), forces());
  sut_.write_variable("hosta", "line1", "line.setpoint", "50");
  EXPECT_TRUE(eventually([&] { return value("line.setpoint") == "50" && value("line.total") == "7"; }));
  sut_.unforce_variable("hosta", "line1", "LINE.total");
  EXPECT_TRUE(eventually([&] { return value("line.total") == "51"; }));
  EXPECT_THAT(forces("line1"), ElementsAre("hosta/line1 grid[1,1]=99"));
  sut_.unforce_all("hosta", "line1");
  EXPECT_THAT(forces(), ElementsAre());
  EXPECT_EQ(value("grid[1,1]"), "99") << "it keeps the value that it has";
  EXPECT_EQ(sut_.unforce_all("hosta", "line1"), "no variable was forced");
  sut_.force_variable("hosta", "line1", "grid[1,1]", "98");
  sut_.unforce_variable("hosta", "line1", "*");
  EXPECT_THAT(forces(), ElementsAre());
}

TEST_F(ClientVariables, AreRefusedByTheHost) {
  const auto refused = [](const ClientError& error, int code, const std::string& text) {
    EXPECT_EQ(error.code(), code) << error.what();
    EXPECT_THAT(error.what(), HasSubstr(text));
  };
  refused(error_of([&] { sut_.write_variable("hosta", "line1", "line.totel", "1"); }), ClientError::not_found,
          "did you mean 'line.total'?");
  refused(error_of([&] { sut_.force_variable("hosta", "line1", "line.totel", "1"); }), ClientError::not_found,
          "no variable 'line.totel'");
  refused(error_of([&] { (void)sut_.sample("hosta", "line1", {"line.totel"}); }), ClientError::not_found,
          "no variable 'line.totel'");
  refused(error_of([&] { sut_.write_variable("hosta", "line1", "line.stopped", "TRUE"); }),
          ClientError::refused, "read-only");
  refused(error_of([&] { sut_.force_variable("hosta", "line1", "line.stopped", "TRUE"); }),
          ClientError::refused, "read-only");
  refused(error_of([&] { sut_.write_variable("hosta", "line1", "line.setpoint", "40000"); }),
          ClientError::invalid_argument, "-32768 to 32767");
  refused(error_of([&] { sut_.unforce_variable("hosta", "line1", "line.total"); }), ClientError::wrong_state,
          "is not forced");
  refused(error_of([&] { (void)sut_.forces("hosta", "line7"); }), ClientError::not_found,
          "no instance 'line7' on host 'hosta'; there are: line1");
  EXPECT_THAT(forces(), ElementsAre());
  EXPECT_EQ(value("line.setpoint"), "20");
}

TEST_F(ClientVariables, AreRefusedBeforeAnythingIsSent) {
  const auto before = host_.requests().size();
  for (const std::string name : {"", "line.total=5", "line.*", "line.tota?", "line.\ntotal", "line.\xff"}) {
    EXPECT_EQ(error_of([&] { sut_.write_variable("hosta", "line1", name, "1"); }).code(),
              ClientError::invalid_argument);
    EXPECT_EQ(error_of([&] { sut_.force_variable("hosta", "line1", name, "1"); }).code(),
              ClientError::invalid_argument);
    EXPECT_THAT(error_of([&] { sut_.unforce_variable("hosta", "line1", name); }).what(),
                HasSubstr("is no name of a variable"));
  }
  EXPECT_EQ(error_of([&] { sut_.write_variable("hosta", "line1", "line.label", "'a\nb'"); }).code(),
            ClientError::invalid_argument);
  EXPECT_EQ(host_.requests().size(), before);
  const auto watch = [&](const std::vector<std::string>& patterns, milliseconds interval) {
    return error_of([&] {
      (void)sut_.watch_variables("hosta", "line1", patterns, interval, [](const Client::Sampled&) {});
    });
  };
  EXPECT_THAT(watch({"fast.*"}, milliseconds(9)).what(),
              HasSubstr("interval 9 ms: allowed are 10 to 3600000"));
  EXPECT_EQ(watch({"fast.*"}, std::chrono::hours(2)).code(), ClientError::invalid_argument);
  EXPECT_EQ(watch({""}, milliseconds(20)).code(), ClientError::invalid_argument);
  EXPECT_EQ(error_of([&] {
              (void)sut_.watch_variables("hosta", "line1", {"fast.*"}, milliseconds(20), nullptr);
            }).code(),
            ClientError::invalid_argument);
}

TEST_F(ClientVariables, AreWatchedInGroupsOfOneCycleEach) {
  constexpr std::size_t kSamples = 12;
  constexpr milliseconds kInterval(20);
  Told told;
  auto watch =
      sut_.watch_variables("hosta", "line1", {"fast.count", "fast.twice"}, kInterval, told.callback());
  ASSERT_TRUE(told.until(kSamples));
  watch.stop();
  const auto all = told.all();
  EXPECT_GE(told.length(), (all.size() - 2) * kInterval) << "faster than its rate";
  std::size_t consistent = 0;
  int last = 0;
  std::chrono::system_clock::time_point last_time{};
  for (const Client::Sampled& sampled : all) {
    ASSERT_TRUE(sampled) << sampled.text;
    ASSERT_EQ(sampled.sample.variables.size(), 2U);
    const int count = std::stoi(sampled.sample.variables[0].value);
    EXPECT_GE(count, last);
    EXPECT_GT(sampled.sample.time, last_time) << "the same sample twice";
    last = count;
    last_time = sampled.sample.time;
    if (!sampled.sample.consistent) continue;
    ++consistent;
    EXPECT_EQ(2 * count, std::stoi(sampled.sample.variables[1].value)) << "values of different cycles";
  }
  EXPECT_GT(consistent, 0U);
  ::usleep(3 * 1000 * kInterval.count());
  EXPECT_EQ(told.all().size(), all.size()) << "it goes on after stop()";
}

TEST_F(ClientVariables, AreWatchedAtSeveralRates) {
  Told fast;
  Told slow;
  const auto first = sut_.watch_variables({}, "line1", {"fast.*"}, milliseconds(10), fast.callback());
  const auto second = sut_.watch_variables({}, "line1", {"line.*"}, milliseconds(100), slow.callback());
  ASSERT_TRUE(slow.until(4));
  EXPECT_TRUE(eventually([&] { return fast.all().size() > slow.all().size(); }));
  sut_.force_variable("hosta", "line1", "line.total", "7");
  EXPECT_TRUE(eventually([&] {
    const auto variables = slow.all().back().sample.variables;
    return std::ranges::any_of(variables, [](const Client::Variable& one) {
      return one.name == "line.total" && one.forced && one.value == "7";
    });
  }));
}

TEST_F(ClientVariables, AreRecordedAsPlcctlRecordsThem) {
  sut_.force_variable("hosta", "line1", "line.total", "7");
  sut_.write_variable("hosta", "line1", "line.label", "'a,\"b'");
  const std::vector<std::string> names{"line.label", "line.s*", "grid[1,2]", "line.total"};
  const std::string file = host_.run_directory() + "/record.csv";
  Client::RecordOptions thrice;
  thrice.interval = milliseconds(10);
  thrice.count = 3;
  EXPECT_EQ(sut_.record_variables({}, "line1", names, thrice, file), 3U);
  const auto ours = lines_of(contents_of(file));
  const auto result =
      run_plcctl(domain_.number(), {"record", "variables", "line1", "line.label", "line.s*", "grid[1,2]",
                                    "line.total", "--interval", "0.01", "--duration", "0.02"});
  EXPECT_EQ(result.code, 0) << result.errors;
  const auto theirs = lines_of(result.output);
  ASSERT_EQ(ours.size(), 4U) << contents_of(file);
  ASSERT_GE(theirs.size(), 2U) << result.output;
  EXPECT_EQ(ours[0], theirs[0]);
  EXPECT_EQ(ours[0],
            "time,time_unix_ns,consistent,\"grid[1,2]\",line.label,line.setpoint,line.stopped,"
            "line.total,forced");
  EXPECT_EQ(values_in(ours[1]), values_in(theirs[1]));
  EXPECT_THAT(values_in(ours[1]), HasSubstr(",\"'a,\"\"b'\",20,"));
  EXPECT_TRUE(ours[1].ends_with(",7,line.total")) << ours[1];
}

TEST_F(ClientVariables, AreRecordedUntilTheSinkHasEnoughOrItsCallerDoes) {
  std::string text;
  const auto count =
      sut_.record_variables("hosta", "line1", {"fast.*"}, {milliseconds(10)}, [&](const std::string& lines) {
        text += lines;
        return std::ranges::count(text, '\n') < 6;
      });
  EXPECT_EQ(count, 5U);
  EXPECT_EQ(lines_of(text).size(), 6U) << text;
  int asked = 0;
  const Client::RecordOptions twice{milliseconds(10), milliseconds(0), 100, [&] { return ++asked < 2; }};
  const std::string file = host_.run_directory() + "/record.csv";
  EXPECT_EQ(sut_.record_variables("hosta", "line1", {"fast.*"}, twice, file), 2U);
  EXPECT_EQ(lines_of(contents_of(file)).size(), 3U) << contents_of(file);
  const Client::RecordOptions hourly{std::chrono::hours(1), milliseconds(0), 2, [&] { return ++asked < 5; }};
  EXPECT_EQ(sut_.record_variables("hosta", "line1", {"fast.*"}, hourly, file), 1U) << "asked while it waits";
  const auto throws = [](const std::string& /*lines*/) -> bool { throw std::out_of_range("mine"); };
  EXPECT_THROW((void)sut_.record_variables("hosta", "line1", {"fast.*"}, {}, throws), std::out_of_range);
}

// It is asked once while the instance stands still, and that one says it.
TEST_F(ClientVariables, ARecordingEndsByOneNoWhileASampleIsAwaited) {
  int samples = 0;
  int asked = 0;
  const auto stops_at_the_third = [&](const std::string& /*lines*/) {
    if (++samples == 3) process_.signal(SIGSTOP);
    return true;
  };
  const auto goes_on = [&] {
    if (samples < 3 || ++asked != 2) return true;
    process_.signal(SIGCONT);
    return false;
  };
  const Client::RecordOptions hundred{milliseconds(10), milliseconds(0), 100, goes_on};
  EXPECT_EQ(sut_.record_variables("hosta", "line1", {"fast.*"}, hundred, stops_at_the_third), 3U);
}

TEST_F(ClientVariables, ARecordingIsRefusedAndLeavesAnEarlierOne) {
  const std::string file = host_.run_directory() + "/record.csv";
  std::ofstream(file) << "an earlier one";
  const auto refusal = [&](const std::vector<std::string>& names, const Client::RecordOptions& options,
                           const std::string& path) {
    return error_of([&] { (void)sut_.record_variables("hosta", "line1", names, options, path); });
  };
  const Client::RecordOptions once{milliseconds(10), milliseconds(0), 1};
  EXPECT_EQ(refusal({"line.totel"}, once, file).code(), ClientError::not_found);
  EXPECT_THAT(refusal({"line.total"}, {}, file).what(), HasSubstr("say the duration"));
  EXPECT_THAT(refusal({"line.total"}, once, "").what(), HasSubstr("name the file"));
  EXPECT_EQ(refusal({"line.total"}, once, host_.run_directory() + "/none/x").code(), ClientError::failed);
  EXPECT_EQ(refusal({""}, once, file).code(), ClientError::invalid_argument);
  EXPECT_THAT(refusal({"line.total"}, {milliseconds(9), milliseconds(1)}, file).what(),
              HasSubstr("interval 9 ms: allowed are 10 to 3600000"));
  EXPECT_THAT(refusal({"line.total"}, {milliseconds(10), milliseconds(-1)}, file).what(),
              HasSubstr("duration -1 ms: allowed are 0 to"));
  EXPECT_EQ(contents_of(file), "an earlier one");
  EXPECT_EQ(error_of([&] {
              (void)sut_.record_variables("hosta", "line1", {"a"}, {}, Client::RecordSink());
            }).code(),
            ClientError::invalid_argument);
}

TEST_F(ClientVariables, ARecordingGoesOnWithTheNextServerAndTellsOfSilenceAtItsEnd) {
  const std::vector<std::string> total{"line.total"};
  bool replaced = false;
  const auto take = [&](const std::string& /*lines*/) {
    if (!std::exchange(replaced, true)) host_.replace_server();
    return true;
  };
  EXPECT_EQ(sut_.record_variables("hosta", "line1", total, {milliseconds(10), milliseconds(0), 4}, take), 4U);
  Client impatient(options(milliseconds(300)));
  const auto stop = [&](const std::string& /*lines*/) {
    process_.signal(SIGSTOP);
    return true;
  };
  const ClientError silent = error_of([&] {
    (void)impatient.record_variables("hosta", "line1", total, {milliseconds(10), milliseconds(500)}, stop);
  });
  process_.signal(SIGCONT);
  EXPECT_TRUE(silent.code() == ClientError::timed_out || silent.code() == ClientError::unavailable)
      << silent.code() << ": " << silent.what();
}

TEST_F(ClientVariables, ARecordingEndsWithItsClientAndIsNoneOfACallback) {
  Client other(options());
  std::promise<void> first;
  auto ended = std::async(std::launch::async, [&] {
    return error_of([&] {
      (void)other.record_variables("hosta", "line1", {"line.total"}, {std::chrono::hours(1)},
                                   [&](const std::string& /*lines*/) {
                                     first.set_value();
                                     return true;
                                   });
    });
  });
  first.get_future().wait();
  other.close();
  EXPECT_EQ(ended.get().code(), ClientError::unavailable);
  std::promise<int> told;
  std::atomic<bool> is_told{false};
  const auto watch = sut_.watch_variables(
      "hosta", "line1", {"line.total"}, milliseconds(10), [&](const Client::Sampled& /*sampled*/) {
        if (is_told.exchange(true)) return;
        const auto all = [](const std::string& /*lines*/) { return true; };
        told.set_value(
            error_of([&] { (void)sut_.record_variables("hosta", "line1", {"line.total"}, {}, all); }).code());
      });
  EXPECT_EQ(told.get_future().get(), ClientError::wrong_state);
}

TEST_F(ClientVariables, AWatchTellsOnceWhyThereIsNoSampleAndGoesOn) {
  Told unknown;
  Told known;
  const auto first =
      sut_.watch_variables("hosta", "line1", {"line.totel"}, milliseconds(10), unknown.callback());
  const auto second =
      sut_.watch_variables("hosta", "line1", {"line.total"}, milliseconds(20), known.callback());
  ASSERT_TRUE(known.until(10));
  const auto all = unknown.all();
  ASSERT_EQ(all.size(), 1U);
  EXPECT_EQ(all.front().code, ClientError::not_found);
  EXPECT_THAT(all.front().text, HasSubstr("no variable 'line.totel'"));
  host_.replace_server();
  const auto before = known.all().size();
  EXPECT_TRUE(known.until(before + 5));
  EXPECT_TRUE(known.all().back()) << known.all().back().text;
}

TEST_F(ClientVariables, ACallbackUsesTheClientAndEndsItsWatch) {
  std::promise<void> called;
  std::promise<void> ready;
  Client::Watch watch;
  watch = sut_.watch_variables("hosta", "line1", {"line.setpoint"}, milliseconds(10),
                               [&, go = ready.get_future().share()](const Client::Sampled& /*sampled*/) {
                                 go.wait();
                                 sut_.write_variable("hosta", "line1", "line.setpoint", "60");
                                 watch.stop();
                                 called.set_value();  // twice would throw
                               });
  ready.set_value();
  called.get_future().wait();
  EXPECT_EQ(value("line.setpoint"), "60");
}

TEST_F(ClientVariables, AreWatchedNoLongerWhenTheClientEnds) {
  Told told;
  Client::Watch watch;
  {
    Client other(options());
    watch = other.watch_variables("hosta", "line1", {"line.total"}, milliseconds(10), told.callback());
    ASSERT_TRUE(told.until(2));
    process_.signal(SIGSTOP);
    ::usleep(50'000);  // a sample is under way
  }
  process_.signal(SIGCONT);
  const auto before = told.all().size();
  ::usleep(50'000);
  EXPECT_EQ(told.all().size(), before);
}

}  // namespace
}  // namespace plchost
