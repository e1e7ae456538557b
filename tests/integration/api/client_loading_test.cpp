// Files that the client library sends to an instance, and the state of it that it shows.
#include <chrono>
#include <csignal>
#include <fstream>
#include <future>
#include <string>

#include <gmock/gmock.h>

#include "schedulers/tasks/task_recorder.hpp"
#include "shm/pages/exception_history.hpp"
#include "tests/integration/api/client_library.hpp"

namespace plchost {
namespace {

using testing::HasSubstr;

TEST_F(ClientLibrary, SendsAFileWithItsOptionsAndTellsHowFarItIs) {
  Client sut(options());
  const std::string file = host_.run_directory() + "/sent.so";
  std::ofstream(file) << std::string(100'000, 'x');
  host_.answer_with({0, ErrorCode::ok, "loaded"});
  std::vector<unsigned long long> received;
  const auto progress = [&](unsigned long long bytes) { received.push_back(bytes); };
  EXPECT_EQ(sut.download_application("hosta", "line1", file, {.boot = true, .online = true}, progress),
            "loaded");
  ASSERT_FALSE(received.empty());
  EXPECT_EQ(received.back(), 100'000U);
  ASSERT_EQ(host_.requests().size(), 1U);
  const ControlRequest request = host_.requests().front();
  EXPECT_EQ(request.verb, ControlVerb::download_application);
  EXPECT_EQ(request.argument, "sent.so");
  EXPECT_EQ(request.options.at("size"), "100000");
  EXPECT_EQ(request.options.at("boot"), "yes");
  EXPECT_EQ(request.options.at("online"), "yes");

  std::promise<Client::Outcome> told;
  sut.download_application("hosta", "line1", file, {}, {},
                           [&](const Client::Outcome& outcome) { told.set_value(outcome); });
  EXPECT_EQ(told.get_future().get().text, "loaded");
  EXPECT_FALSE(host_.requests().back().options.contains("boot"));
}

TEST_F(ClientLibrary, LetsAProgressWaitForOtherCalls) {
  Client sut(options());
  const std::string file = host_.run_directory() + "/sent.so";
  std::ofstream(file) << std::string(100'000, 'x');
  host_.answer_with({0, ErrorCode::ok, "done"});
  std::vector<std::string> answers;
  std::promise<Client::Outcome> told;
  const auto progress = [&](unsigned long long /*bytes*/) {
    answers.push_back(sut.start("hosta", "line1"));
    if (answers.size() > 1) return;
    sut.command("stop", "hosta", "line1", {},
                [&](const Client::Outcome& outcome) { told.set_value(outcome); });
  };
  EXPECT_EQ(sut.download_application("hosta", "line1", file, {}, progress), "done");
  ASSERT_FALSE(answers.empty());
  EXPECT_THAT(answers, testing::Each(std::string("done")));
  EXPECT_TRUE(told.get_future().get());
}

TEST_F(ClientLibrary, WaitsForAHostThatHasTheFileOnlyWhileItIsThere) {
  Client sut(options());
  const std::string file = host_.run_directory() + "/sent.so";
  std::ofstream(file) << std::string(100'000, 'x');
  host_.silent = true;
  const auto progress = [&](unsigned long long bytes) {
    if (bytes == 100'000) host_.server().signal(SIGKILL);
  };
  auto told = std::async(std::launch::async, [&] {
    return error_of([&] { (void)sut.download_application("hosta", "line1", file, {}, progress); });
  });
  constexpr std::chrono::seconds kLoading{100};  // less than a host may take to load
  ASSERT_EQ(told.wait_for(kLoading), std::future_status::ready);
  EXPECT_THAT(told.get().what(), HasSubstr("has not said what became of it"));
}

TEST_F(ClientLibrary, SaysWhichFileItCannotSend) {
  Client sut(options());
  const ClientError missing =
      error_of([&] { (void)sut.download_application("hosta", "line1", "some/app.so"); });
  EXPECT_EQ(missing.code(), ClientError::failed);
  EXPECT_THAT(missing.what(), HasSubstr("some/app.so cannot be opened here"));
  std::promise<Client::Outcome> told;
  sut.download_application("hosta", "line1", host_.run_directory(), {}, {},
                           [&](const Client::Outcome& outcome) { told.set_value(outcome); });
  EXPECT_THAT(told.get_future().get().text, HasSubstr("is a folder"));
  EXPECT_TRUE(host_.requests().empty());
}

TEST_F(ClientLibrary, LoadsAndRollsBackWithOptionsThatOtherCommandsDoNotTake) {
  Client sut(options());
  sut.load_application("hosta", "line1", "/opt/line.so", {.boot = true});
  EXPECT_EQ(host_.requests().back().verb, ControlVerb::load_application);
  EXPECT_EQ(host_.requests().back().options.at("boot"), "yes");
  EXPECT_FALSE(host_.requests().back().options.contains("online"));
  sut.rollback_application("hosta", "line1", {.online = true});
  EXPECT_EQ(host_.requests().back().verb, ControlVerb::rollback_application);
  EXPECT_EQ(host_.requests().back().options.at("online"), "yes");
  std::promise<Client::Outcome> told;
  sut.command("rollback application", "hosta", "line1", {},
              [&](const Client::Outcome& outcome) { told.set_value(outcome); }, {.boot = true});
  EXPECT_TRUE(told.get_future().get());
  EXPECT_EQ(host_.requests().back().options.at("boot"), "yes");

  const auto wrong = error_of([&] { (void)sut.command("stop", "hosta", "line1", {}, {.boot = true}); });
  EXPECT_EQ(wrong.code(), ClientError::invalid_argument);
  EXPECT_EQ(host_.requests().size(), 3U);
}

TEST_F(ClientLibrary, ShowsExceptionsAndApplicationsAndTellsOfEach) {
  Client sut(options());
  const auto before = sut.exceptions("hosta");
  ASSERT_EQ(before.size(), 1U);
  EXPECT_EQ(before.front().instance, "line1");
  EXPECT_EQ(before.front().count, 0U);
  EXPECT_TRUE(sut.applications("hosta").empty());
  std::promise<Client::Exception> told;
  const auto watch = sut.watch_exceptions("hosta", [&](const Client::Exception& exception) {
    if (exception.count == 1) told.set_value(exception);
  });
  const std::string path = exception_path(host_.run_directory(), "line1");
  auto history = read_exceptions(path).value();
  history.add({.unix_ns = 1'789'000'000'123'456'789,
               .application = "/opt/line.so",
               .task = "Main",
               .kind = "signal",
               .whole_application = true,
               .signal = "SIGFPE",
               .address = 0x7f0012345678,
               .symbol = "divide()+0x12 in line.so",
               .text = "integer division by zero",
               .back_trace = {"divide(int, int)+0x12 in line.so", "fill()+0x7 in line.so"},
               .back_trace_end = {}});
  ASSERT_TRUE(write_exceptions(path, history));
  const Client::Exception exception = told.get_future().get();
  EXPECT_EQ(exception.task, "Main");
  EXPECT_EQ(exception.signal, "SIGFPE");
  EXPECT_EQ(exception.back_trace, history.entries.back().back_trace) << "a list of its own";
  EXPECT_EQ(exception.time.time_since_epoch(), std::chrono::nanoseconds(1'789'000'000'123'456'789));
  EXPECT_EQ(sut.exceptions().front(), exception);
}

TEST_F(ClientLibrary, ShowsAllFiguresOfATask) {
  Client sut(options());
  InstancePage page = host_.make_page("line1", "Main", 4711);
  TaskRecorder task(page.statistics(0), TimePoint{});
  for (int i = 0; i < 50; ++i) {
    const TimePoint release{i * std::chrono::milliseconds(1)};
    task.record({.release = release,
                 .start = release + Duration(3'000),
                 .end = release + Duration(9'000),
                 .interval = std::chrono::milliseconds(1)});
  }
  Client::TaskStatistics shown;
  while (shown.recorded != 50) shown = sut.statistics("hosta", "line1", "Main");
  EXPECT_EQ(shown.task, "Main");
  EXPECT_EQ(shown.latency.max, std::chrono::nanoseconds(3'000));
  EXPECT_EQ(shown.execution.average, std::chrono::nanoseconds(6'000));
  EXPECT_EQ(shown.latency_histogram.total, 50U);
  ASSERT_EQ(shown.latency_histogram.bars.size(), 1U);
  EXPECT_EQ(shown.latency_histogram.bars.front().count, 50U);
  EXPECT_EQ(shown.latency_histogram.percentiles[2], std::chrono::nanoseconds(3'000));
  int code = 0;  // a machine that does not find the host in one time gets a longer one
  for (std::chrono::milliseconds timeout(300); code != ClientError::timed_out && timeout < kPatience;
       timeout *= 4) {
    Client short_of_time(options(timeout));
    code = error_of([&] { (void)short_of_time.statistics("hosta", "line1", "Nothing"); }).code();
  }
  EXPECT_EQ(code, ClientError::timed_out);
}

}  // namespace
}  // namespace plchost
