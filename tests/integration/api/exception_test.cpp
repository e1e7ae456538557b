// The last exception of each instance, from its file to plcctl.
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include <fcntl.h>
#include <gmock/gmock.h>
#include <nlohmann/json.hpp>
#include <sys/stat.h>

#include "shm/pages/exception_history.hpp"
#include "tests/integration/api/test_host.hpp"

namespace plchost {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

class ExceptionOfAnInstance : public testing::Test {
 protected:
  ExceptionOfAnInstance() {
    host_.write_instance(0, "line1", InstanceState::running, 4711);
    host_.write_instance(1, "line2", InstanceState::running, 4712);
    host_.write_count(2);
    host_.start_server();
  }

  [[nodiscard]] std::string path() const { return exception_path(host_.run_directory(), "line1"); }
  /// One more in the file of line1, as its process would write it.
  void add(const std::string& task) {
    auto history = read_exceptions(path()).value();
    history.add(
        {.unix_ns = 1'789'000'000'123'456'789,
         .application = "/opt/line.so",
         .task = task,
         .kind = "signal",
         .whole_application = true,
         .signal = "SIGFPE",
         .address = 0x7f0012345678,
         .symbol = "divide()+0x12 in line.so",
         .text = "integer division by zero",
         .back_trace = {"divide()+0x12 in line.so", "fill()+0x7 in line.so"},
         .back_trace_end = "only a part is known",
         .activity = {"-1.204 ms Fill: start, 3.1 us after its release", "-0.000 ms Fill: posts \x1b"},
         .circumstances = {.version = "0.1.0",
                           .build = "GCC 12, build ID 4f",
                           .scheduler = "CmpSchedule",
                           .settings = "cyclic, interval 10 ms, priority 4, core 1",
                           .cycles = 77,
                           .uptime_ns = 12'345'000'000}});
    ASSERT_TRUE(write_exceptions(path(), history));
  }
  std::optional<plc_ExceptionStatus> shown(const std::string& instance) {
    const auto all = client_->exceptions(host_.name(), soon());
    EXPECT_TRUE(all) << all.error().describe();
    for (const auto& exception : all.value_or(std::vector<plc_ExceptionStatus>{})) {
      if (exception.instance == instance) return exception;
    }
    return std::nullopt;
  }
  [[nodiscard]] bool eventually_shown(std::uint64_t count) {
    for (const TimePoint end = soon(); MonotonicClock::now() < end;) {
      if (const auto seen = shown("line1"); seen && seen->count == count) return true;
      client_->wait_for_change(MonotonicClock::now() + std::chrono::milliseconds(20));
    }
    return false;
  }
  [[nodiscard]] RunResult run(std::vector<std::string> arguments) const {
    return run_plcctl(domain_.number(), std::move(arguments));
  }

  OwnDomain domain_;
  TestHost host_{domain_, "hosta"};
  std::unique_ptr<ControlClient> client_ = connect(domain_);
};

TEST_F(ExceptionOfAnInstance, IsShownWithAllThatIsKnown) {
  add("Fill");
  ASSERT_TRUE(eventually_shown(1));
  const auto seen = shown("line1").value();
  EXPECT_STREQ(seen.task, "Fill");
  EXPECT_EQ(seen.kind, 1U);
  EXPECT_STREQ(seen.signal, "SIGFPE");
  EXPECT_STREQ(seen.symbol, "divide()+0x12 in line.so");
  EXPECT_STREQ(seen.text, "integer division by zero");
  EXPECT_STREQ(seen.application, "/opt/line.so");
  EXPECT_EQ(seen.address, 0x7f0012345678U);
  EXPECT_EQ(seen.time_unix_ns, 1'789'000'000'123'456'789);
  EXPECT_TRUE(seen.whole_application);
  EXPECT_STREQ(seen.back_trace, "divide()+0x12 in line.so\nfill()+0x7 in line.so");
  EXPECT_STREQ(seen.back_trace_end, "only a part is known");
  EXPECT_EQ(shown("line2")->count, 0U);
  add("Label");
  ASSERT_TRUE(eventually_shown(2));
  EXPECT_STREQ(shown("line1")->task, "Label");
}

// As a record on disk that somebody has changed.
TEST_F(ExceptionOfAnInstance, OfAKindThatTheContractDoesNotHaveIsOfNone) {
  ExceptionEntry entry;
  entry.task = "Fill";
  entry.kind = "boredom";
  ExceptionHistory history;
  history.add(entry);
  ASSERT_TRUE(write_exceptions(path(), history));
  ASSERT_TRUE(eventually_shown(1));
  EXPECT_EQ(shown("line1")->kind, 0U);
  const auto json = nlohmann::json::parse(run({"show", "exception", "line1", "--json"}).output);
  EXPECT_EQ(json[0]["kind"], "none");
}

TEST_F(ExceptionOfAnInstance, IsPresentUntilTheProcessIsReplaced) {
  auto page = host_.make_page("line1", "Fill", 4711);
  page.task(0).state.store(static_cast<std::uint32_t>(PageTaskState::exception));
  add("Fill");
  const auto becomes = [&](bool present) {
    for (const TimePoint end = soon(); MonotonicClock::now() < end;) {
      if (const auto seen = shown("line1"); seen && seen->count == 1 && seen->present == present) return true;
      client_->wait_for_change(MonotonicClock::now() + std::chrono::milliseconds(20));
    }
    return false;
  };
  EXPECT_TRUE(becomes(true));
  page = host_.make_page("line1", "Fill", 4713);
  host_.write_instance(0, "line1", InstanceState::stopped, 4713);
  EXPECT_TRUE(becomes(false));
}

TEST_F(ExceptionOfAnInstance, OutlivesAFileThatIsNone) {
  add("Fill");
  ASSERT_TRUE(eventually_shown(1));
  std::ofstream(path()) << "{\"version\": 1, \"count\": \"many\"";
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  EXPECT_EQ(shown("line1")->count, 1U);
  // At one instant: a file that is not there is one without exceptions.
  const std::string folder = path() + ".folder";
  std::filesystem::create_directory(folder);
  ASSERT_EQ(::renameat2(AT_FDCWD, folder.c_str(), AT_FDCWD, path().c_str(), RENAME_EXCHANGE), 0);
  std::filesystem::remove(folder);
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  EXPECT_EQ(shown("line1")->count, 1U);
  std::filesystem::remove(path());
  add("Fill");
  add("Label");
  EXPECT_TRUE(eventually_shown(2));
}

TEST_F(ExceptionOfAnInstance, IsGoneWithTheInstanceAndBackWithIt) {
  add("Fill");
  ASSERT_TRUE(eventually_shown(1));
  host_.write_instance(0, "line2", InstanceState::running, 4712);
  host_.write_count(1);
  const auto awaited = [&](bool there) {
    for (const TimePoint end = soon(); MonotonicClock::now() < end;) {
      if (shown("line1").has_value() == there) return true;
      client_->wait_for_change(MonotonicClock::now() + std::chrono::milliseconds(20));
    }
    return false;
  };
  EXPECT_TRUE(awaited(false));
  EXPECT_TRUE(shown("line2"));
  host_.write_instance(1, "line1", InstanceState::running, 4711);
  host_.write_count(2);
  EXPECT_TRUE(awaited(true));
  EXPECT_EQ(shown("line1")->count, 1U);
}

TEST_F(ExceptionOfAnInstance, IsToldByPlcctl) {
  add("Fill");
  ASSERT_TRUE(eventually_shown(1));
  const auto text = run({"show", "exception", "line1"});
  EXPECT_EQ(text.code, 0) << text.errors;
  EXPECT_THAT(text.output, AllOf(HasSubstr("Fill"), HasSubstr("SIGFPE"), HasSubstr("0x7f0012345678"),
                                 HasSubstr("divide()+0x12"), HasSubstr("2026-09-10T"), HasSubstr(".123Z")));
  EXPECT_THAT(text.output, HasSubstr("back_trace_end  only a part is known\n"
                                     "back_trace\n"
                                     "  #0  divide()+0x12 in line.so\n"
                                     "  #1  fill()+0x7 in line.so\n"
                                     "activity\n"
                                     "  -1.204 ms Fill: start, 3.1 us after its release\n"
                                     "  -0.000 ms Fill: posts ?\n"));
  EXPECT_THAT(text.output, Not(HasSubstr("memory_address"))) << "nothing is known of it";
  EXPECT_THAT(text.output, AllOf(HasSubstr("settings        cyclic, interval 10 ms, priority 4, core 1\n"),
                                 HasSubstr("cycles          77\n"), HasSubstr("uptime          12.3 s\n")));
  const auto json = nlohmann::json::parse(run({"show", "exception", "line1", "--json"}).output);
  ASSERT_EQ(json.size(), 1U);
  EXPECT_EQ(json[0]["count"], 1);
  EXPECT_EQ(json[0]["address"], 0x7f0012345678);
  EXPECT_EQ(json[0]["time_unix_ns"], 1'789'000'000'123'456'789);
  EXPECT_EQ(json[0]["stopped"], "application");
  EXPECT_EQ(json[0]["uptime_us"], 12'345'000.0);
  EXPECT_EQ(json[0]["version"], "0.1.0");
  EXPECT_EQ(json[0]["build"], "GCC 12");
  EXPECT_EQ(json[0]["build_id"], "4f");
  EXPECT_EQ(json[0]["scheduler"], "CmpSchedule");
  EXPECT_EQ(json[0]["settings"], "cyclic, interval 10 ms, priority 4, core 1");
  EXPECT_EQ(json[0]["cycles"], 77);
  EXPECT_EQ(json[0]["back_trace"], "divide()+0x12 in line.so\nfill()+0x7 in line.so");
  const auto list = nlohmann::json::parse(run({"list", "exceptions", "--json"}).output);
  ASSERT_EQ(list.size(), 1U) << "line2 never had any";
  EXPECT_EQ(list[0]["instance"], "line1");
  EXPECT_THAT(run({"list", "exceptions"}).output, HasSubstr("integer division by zero"));
}

TEST_F(ExceptionOfAnInstance, HasAsManyWholeFunctionsAsThereIsRoomFor) {
  ExceptionEntry entry;
  entry.task = "Fill";
  entry.back_trace.assign(32, std::string(400, 'x'));
  ExceptionHistory history;
  history.add(entry);
  ASSERT_TRUE(write_exceptions(path(), history));
  ASSERT_TRUE(eventually_shown(1));
  const auto seen = shown("line1").value();
  EXPECT_EQ(std::string(seen.back_trace).size(), 10 * 401U - 1);
  EXPECT_STREQ(seen.back_trace_end, "only the innermost 10 functions fit");
}

TEST_F(ExceptionOfAnInstance, HasTheLastEntriesOfTheActivityThatThereIsRoomFor) {
  ExceptionEntry entry;
  entry.task = "Fill";
  for (int i = 0; i < 60; ++i) entry.activity.push_back(std::to_string(i) + std::string(98, 'x'));
  ExceptionHistory history;
  history.add(entry);
  ASSERT_TRUE(write_exceptions(path(), history));
  ASSERT_TRUE(eventually_shown(1));
  const std::string seen = shown("line1").value().activity;
  EXPECT_THAT(seen, AllOf(::testing::StartsWith("20x"), ::testing::EndsWith(entry.activity.back())));
}

TEST_F(ExceptionOfAnInstance, IsInTheReport) {
  add("Fill");
  add("Label");
  ASSERT_TRUE(eventually_shown(2));
  const std::string file = path() + ".report.json";
  const auto saved = run({"--timeout", "2", "save", "report", "line1", file});
  ASSERT_EQ(saved.code, 0) << saved.errors;
  struct stat status{};
  ASSERT_EQ(::stat(file.c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777U, 0600U);
  const auto report = nlohmann::json::parse(std::ifstream(file));
  EXPECT_EQ(report["report"], 1);
  EXPECT_EQ(report["host"]["host"], "hosta");
  EXPECT_NE(report["host"]["version"], "");
  ASSERT_EQ(report["instance"].size(), 1U) << "line2 is none of its";
  EXPECT_EQ(report["instance"][0]["name"], "line1");
  ASSERT_EQ(report["exception"].size(), 1U);
  EXPECT_EQ(report["exception"][0]["task"], "Label");
  EXPECT_EQ(report["exception"][0]["settings"], "cyclic, interval 10 ms, priority 4, core 1");
  EXPECT_FALSE(report.contains("audit")) << "nobody has asked for it";
  for (const char* const part : {"applications", "tasks", "events", "transitions"}) {
    EXPECT_TRUE(report[part].is_array()) << part;
  }
  // No manager is here to answer for its part.
  for (const char* const part : {"findings", "log"}) {
    const bool told = saved.output.find(std::string(part) + ": ") != std::string::npos;
    EXPECT_NE(report.contains(part), told) << saved.output;
  }
  std::filesystem::remove(file);
  const auto unknown = run({"save", "report", "line3", file});
  EXPECT_EQ(unknown.code, 1);
  EXPECT_THAT(unknown.errors, HasSubstr("no instance 'line3'"));
  EXPECT_FALSE(std::filesystem::exists(file));
}

TEST_F(ExceptionOfAnInstance, IsInAReportThatTellsNoSecret) {
  add("Fill");
  ASSERT_TRUE(eventually_shown(1));
  namespace fs = std::filesystem;
  // Where a host has secrets: settings, which may be passwords, keys, values of variables in the audit log.
  for (const char* const name : {"line1.settings", "line1.key", "host.pem", "line1.events"})
    std::ofstream(host_.run_directory() + "/" + name) << "Parameter.Password=swordfish\nPRIVATE KEY\n";
  const std::string audit = path() + ".audit";
  fs::create_directory(audit);
  std::ofstream(audit + "/audit.0000000001.log")
      << R"({"n":1,"who":"anna","what":"write variable","on":"line1","argument":"Pin=swordfish","text":"swordfish before"})"
      << "\n"
      << R"({"n":2,"who":"anna","what":"stop","on":"line1","argument":"","text":""})" << "\n"
      << R"({"n":2,"who":"anna","what":"debug","on":"line1","argument":"local Fill 0 Pin=swordfish","text":"swordfish"})"
      << "\n"
      << R"({"n":3,"who":"anna","what":"stop","on":"line2","argument":"","text":"swordfish"})" << "\n{torn";
  const std::string file = path() + ".report.json";
  const auto saved = run({"--timeout", "2", "save", "report", "line1", file, "--audit", audit});
  ASSERT_EQ(saved.code, 0) << saved.errors;
  std::ifstream stream(file);
  const std::string text{std::istreambuf_iterator<char>(stream), {}};
  fs::remove(file);
  for (const char* const secret : {"swordfish", "PRIVATE", "Password"})
    EXPECT_THAT(text, Not(HasSubstr(secret)));
  const auto records = nlohmann::json::parse(text)["audit"];
  ASSERT_EQ(records.size(), 3U);
  EXPECT_EQ(records[0]["argument"], "Pin");
  EXPECT_EQ(records[1]["what"], "stop");
  EXPECT_EQ(records[2]["argument"], "local Fill 0 Pin");
  const auto refused = run({"--timeout", "2", "save", "report", "line1", file, "--audit", audit + "/none"});
  EXPECT_THAT(refused.output + refused.errors, HasSubstr("has not all: audit: "));
  fs::remove(file);
}

TEST_F(ExceptionOfAnInstance, IsInNoReportInPlaceOfWhatIsNoPlainFile) {
  namespace fs = std::filesystem;
  const std::string folder = path() + ".reports";
  fs::create_directory(folder);
  const std::string file = folder + "/report";
  std::ofstream(file + ".new") << "the user's own";
  const auto save = [&] { return run({"--timeout", "2", "save", "report", "line1", file}); };
  EXPECT_EQ(save().code, 0);
  EXPECT_EQ(save().code, 0) << "an earlier report is replaced";
  EXPECT_EQ(fs::file_size(file + ".new"), 14U);
  fs::remove(file + ".new");
  EXPECT_EQ(std::distance(fs::directory_iterator(folder), {}), 1);
  const auto refused = [&] {
    const auto saved = save();
    EXPECT_EQ(saved.code, 1);
    EXPECT_THAT(saved.errors, AllOf(HasSubstr(file), HasSubstr("is no plain file")));
    EXPECT_EQ(std::distance(fs::directory_iterator(folder), {}), 1);
  };
  fs::remove(file);
  fs::create_symlink("/dev/null", file);
  refused();
  EXPECT_TRUE(fs::is_symlink(file));
  fs::remove(file);
  ASSERT_EQ(::mkfifo(file.c_str(), 0600), 0);
  refused();
  EXPECT_TRUE(fs::is_fifo(file));
  fs::remove(file);
  fs::create_directory(file);
  refused();
  fs::remove_all(folder);
}

TEST_F(ExceptionOfAnInstance, ThatNeverWasIsNoErrorButAnUnknownInstanceIs) {
  const auto none = run({"show", "exception", "line2"});
  EXPECT_EQ(none.code, 0);
  EXPECT_EQ(none.output, "instance 'line2' has had no exception\n");
  const auto json = nlohmann::json::parse(run({"show", "exception", "line2", "--json"}).output);
  EXPECT_EQ(json[0]["count"], 0);
  const auto unknown = run({"show", "exception", "line3"});
  EXPECT_EQ(unknown.code, 1);
  EXPECT_THAT(unknown.errors, AllOf(HasSubstr("no instance 'line3'"), HasSubstr("line1, line2")));
}

}  // namespace
}  // namespace plchost
