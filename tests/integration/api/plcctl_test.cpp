#include <filesystem>
#include <fstream>
#include <thread>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include "schedulers/tasks/task_recorder.hpp"
#include "tests/integration/api/test_host.hpp"
#include "tests/support/own_name.hpp"

namespace plchost {
namespace {

using testing::HasSubstr;

class Plcctl : public testing::Test {
 protected:
  Plcctl() {
    page_ = host_.make_page("line1", "Main", 4711);
    host_.write_instance(0, "line1", InstanceState::running, 4711);
    host_.write_count(1);
    event_ = host_.add_event("line1", "ready");
    event_.set_bound_tasks(1);
    host_.start_server();
  }
  [[nodiscard]] RunResult run(std::vector<std::string> arguments) const {
    return run_plcctl(domain_.number(), std::move(arguments));
  }

  OwnDomain domain_;
  TestHost host_{domain_, "hosta"};
  std::optional<InstancePage> page_;
  PoolEvent event_;
};

TEST_F(Plcctl, ListsInstancesAsFlatObjects) {
  const auto result = run({"list", "instances", "--json"});
  ASSERT_EQ(result.code, 0) << result.errors;
  const auto json = nlohmann::json::parse(result.output);
  ASSERT_EQ(json.size(), 1U);
  for (const char* field : {"host", "name", "state", "pid", "core", "scheduler", "application", "restarts"}) {
    EXPECT_TRUE(json[0].contains(field)) << field;
  }
  EXPECT_EQ(json[0]["state"], "running");
  EXPECT_EQ(json[0]["pid"], 4711);
}

TEST_F(Plcctl, ShowsHowAnInstanceIsStartedAndRestarted) {
  const auto result = run({"show", "instance", "line1", "--json"});
  ASSERT_EQ(result.code, 0) << result.errors;
  const auto json = nlohmann::json::parse(result.output)[0];
  EXPECT_EQ(json["settings"], "/etc/line1.cfg");
  EXPECT_EQ(json["configured"], "/opt/line1.so");
  EXPECT_EQ(json["loaded"], "") << "its process says that it has none";
  EXPECT_EQ(json["loaded_version"], nullptr);
  EXPECT_EQ(json["priority_band"], "normal");
  EXPECT_EQ(json["after"], "io,axis");
  EXPECT_EQ(json["autostart"], true);
  EXPECT_EQ(json["restart_policy"], "on-failure");
  EXPECT_EQ(json["restart_delay_us"], 100'000);
  EXPECT_EQ(json["restart_delay_max_us"], 5'000'000);
  EXPECT_EQ(json["crash_limit"], 5);
  EXPECT_EQ(json["crash_window_us"], 60'000'000);
  EXPECT_THAT(run({"show", "instance", "line1"}).output, testing::HasSubstr("on-failure"));
}

TEST_F(Plcctl, ListsTasksWithUnitsInTheFieldNames) {
  const auto result = run({"list", "tasks", "--json"});
  ASSERT_EQ(result.code, 0) << result.errors;
  const auto json = nlohmann::json::parse(result.output);
  ASSERT_EQ(json.size(), 1U);
  for (const char* field :
       {"instance", "task", "kind", "priority", "interval_us", "state", "cycles", "lost_cycles",
        "lost_events", "exec_last_us", "exec_avg_us", "exec_min_us", "exec_max_us", "latency_p50_us",
        "latency_p99_us", "latency_max_us", "jitter_max_us"}) {
    EXPECT_TRUE(json[0].contains(field)) << field;
  }
  EXPECT_EQ(json[0]["interval_us"], 1000.0);
}

TEST_F(Plcctl, ListsHostsEventsAndObjects) {
  EXPECT_THAT(run({"list", "hosts"}).output, HasSubstr("hosta"));
  EXPECT_THAT(run({"list", "events"}).output, HasSubstr("ready"));
  EXPECT_THAT(run({"list", "objects"}).output, HasSubstr("line1/ready"));
}

TEST_F(Plcctl, ShowsWhatAnInstanceCannotSave) {
  InstanceRuntime runtime;
  runtime.pid = 4711;
  runtime.running = 1;
  runtime.retain_problem.assign("retain variables are not written: the disk is full");
  page_->write_runtime(runtime);
  const auto shows = [&](const char* list, const char* text) {
    for (const TimePoint end = soon(); MonotonicClock::now() < end;) {
      if (run({"list", list, "-o", "csv"}).output.find(text) != std::string::npos) return true;
    }
    return false;
  };
  EXPECT_TRUE(shows("instances", "retain variables are not written: the disk is full"));
  EXPECT_TRUE(shows("hosts", "retain variables are not written: line1"));
}

TEST_F(Plcctl, PrintsCommaSeparatedValues) {
  const auto result = run({"list", "instances", "-o", "csv"});
  ASSERT_EQ(result.code, 0) << result.errors;
  EXPECT_THAT(result.output, testing::StartsWith("host,name,state,pid,"));
  EXPECT_THAT(result.output, HasSubstr("\nhosta,line1,running,4711,"));
  EXPECT_EQ(run({"list", "instances", "-o", "xml"}).code, 2);
}

TEST_F(Plcctl, ListsWhatThereIsWhereWordsAreMissing) {
  for (const std::vector<std::string>& words :
       {std::vector<std::string>{}, {"list"}, {"help"}, {"help", "list"}}) {
    const auto result = run_program(PLCCTL_PROGRAM, words);
    const bool asked = !words.empty() && words.front() == "help";
    EXPECT_EQ(result.code, asked ? 0 : 2);
    EXPECT_THAT(result.output, HasSubstr("instances [INSTANCE]"));
  }
  EXPECT_THAT(run({"help", "list"}).output, HasSubstr("instances [INSTANCE]")) << "behind options, too";
  const auto option = run_program(PLCCTL_PROGRAM, {"list", "instances", "--colums=name"});
  EXPECT_EQ(option.code, 2);
  EXPECT_THAT(option.errors, HasSubstr("unknown option '--colums' (did you mean '--columns'?); known are "));
}

TEST_F(Plcctl, ShowsTheColumnsThatAreAskedForInTheirOrder) {
  const auto several =
      run({"list", "instances", "--columns", "name,state", "--sort-by", "-name", "-o", "csv"});
  EXPECT_EQ(several.output, "name,state\nline1,running\n") << several.errors;
  EXPECT_EQ(run({"list", "instances", "--columns=state,name", "-o", "csv", "line1"}).output,
            "state,name\nrunning,line1\n");
}

TEST_F(Plcctl, SaysWhatIsWrongWithAValueThatLooksLikeAnOption) {
  EXPECT_THAT(run({"post", "event", "line1/ready", "--count", "-3"}).errors,
              HasSubstr("Value -3 not in range"));
}

TEST_F(Plcctl, TakesSeveralNamesAndPatterns) {
  host_.write_instance(1, "line2", InstanceState::offline, 0);
  host_.write_instance(2, "press", InstanceState::running, 4712);
  host_.write_count(3);
  const auto names_in = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), {"--columns", "name", "--sort-by", "-name", "-o", "csv"});
    return run(std::move(arguments)).output;
  };
  EXPECT_EQ(names_in({"list", "instances"}), "name\npress\nline2\nline1\n");
  EXPECT_EQ(names_in({"list", "instances", "line*"}), "name\nline2\nline1\n");
  EXPECT_EQ(names_in({"list", "instances", "press", "line1"}), "name\npress\nline1\n");
  EXPECT_THAT(run({"list", "instances", "prss"}).errors, HasSubstr("did you mean 'press'?"));
  EXPECT_THAT(run({"list", "instances", "x*"}).errors, HasSubstr("there are: line1, line2, press"));
  EXPECT_THAT(run({"list", "instances", "line2"}).output, testing::Not(HasSubstr("-1")));
  EXPECT_THAT(run({"show", "instance", "line2"}).output, testing::Not(HasSubstr("unix_s")));
  EXPECT_EQ(run({"list", "instances", "--columns", "nmae"}).code, 2);
}

TEST_F(Plcctl, TakesNoTimeThatIsNoNumber) {
  for (const std::vector<std::string>& words :
       {std::vector<std::string>{"--timeout", "nan", "list", "hosts"},
        {"list", "hosts", "--watch", "--every", "nan"},
        {"watch", "variables", "line1", "n", "--interval", "nan"},
        {"record", "variables", "line1", "n", "--duration", "-NaN"}}) {
    const auto refused = run(words);
    EXPECT_EQ(refused.code, 2) << words.front();
    EXPECT_THAT(refused.errors, HasSubstr("is no number"));
  }
}

TEST_F(Plcctl, WaitsForTheStateOfInstances) {
  EXPECT_EQ(run({"wait", "instance", "line1"}).output, "line1: running\n");
  EXPECT_EQ(run({"wait", "instance", "line1", "-q"}).output, "");
  RunResult late;
  for (const char* const timeout :
       {"0.3", "3", "20"}) {  // a machine that is too slow for one gets a longer one
    late = run({"wait", "instance", "line1", "--for", "stopped", "--timeout", timeout});
    if (late.errors.contains("is not stopped")) break;
  }
  EXPECT_EQ(late.code, 3);
  EXPECT_THAT(late.errors, HasSubstr("'line1' is not stopped but running"));
  EXPECT_EQ(run({"wait", "instance", "line1", "--for", "happy"}).code, 2);
}

TEST_F(Plcctl, WaitsOnceForAnInstanceThatIsNamedTwice) {
  for (const char* const again : {"line1", "l*"}) {
    const auto twice = run({"wait", "instance", "line1", again});
    EXPECT_EQ(twice.code, 0) << twice.errors;
    EXPECT_EQ(twice.output, "line1: running\n");
  }
}

TEST_F(Plcctl, CompletesTheNamesThatThereAre) {
  const auto offered = [&](std::vector<std::string> words) {
    words.insert(words.begin(),
                 {"__complete", "--domain", std::to_string(domain_.number()), "--timeout", "20"});
    return run_program(PLCCTL_PROGRAM, words).output;
  };
  EXPECT_EQ(offered({"show", "instance", ""}), "line1\trunning\n");
  EXPECT_EQ(offered({"post", "event", "l"}), "line1/ready\t0 posts\n");
  EXPECT_EQ(offered({"post", "event", "x"}), "");
  EXPECT_EQ(offered({"show", "task", ""}), "line1/Main\tcyclic, created\n");
  EXPECT_EQ(offered({"--host", ""}), "hosta\t1 instance\n");
  EXPECT_THAT(offered({"show", "object", ""}), HasSubstr("line1/ready\t"));
  EXPECT_EQ(offered({"load", "application", "line1", ""}), ":files\n");
}

TEST_F(Plcctl, CompletesInBash) {
  const std::string folder = std::filesystem::path(PLCCTL_PROGRAM).parent_path();
  const std::string script = "PATH=" + folder + ":$PATH PLCHOST_DOMAIN=" + std::to_string(domain_.number()) +
                             "; export PLCHOST_DOMAIN; source <(plcctl completion bash); COMP_WORDS=(plcctl "
                             "--timeout 20 show instance l); "
                             "COMP_CWORD=5; _plcctl; echo \"${COMPREPLY[@]}\"";
  EXPECT_EQ(run_program("/bin/bash", {"-c", script}).output, "line1\n");
}

TEST(Completion, LetsNoNameBeRunByTheShell) {
  const std::string script =
      "source <(" PLCCTL_PROGRAM
      " completion bash); plcctl() { printf 'x$(touch y);z\\tan object\\na b\\t\\n'; }; "
      "COMP_WORDS=(plcctl show object x); COMP_CWORD=3; _plcctl; printf '%s\\n' \"${COMPREPLY[@]}\"";
  EXPECT_EQ(run_program("/bin/bash", {"-c", script}).output, "x\\$\\(touch\\ y\\)\\;z\na\\ b\n");
}

TEST_F(Plcctl, WatchesAListUntilItIsAskedToEnd) {
  EXPECT_EQ(run({"check", "host", "--watch"}).code, 2) << "that is no list";
  const std::string seen = own_path("watch");
  Child watch(PLCCTL_PROGRAM,
              {"--domain", std::to_string(domain_.number()), "--timeout", "60", "list", "instances", "-w",
               "--every", "0.1"},
              seen);
  const auto looks = [&] {
    std::ifstream file(seen);
    const std::string text{std::istreambuf_iterator<char>(file), {}};
    std::size_t count = 0;
    for (auto at = text.find("line1"); at != std::string::npos; at = text.find("line1", at + 1)) ++count;
    return count;
  };
  for (const TimePoint end = soon(); looks() < 3 && MonotonicClock::now() < end;) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  EXPECT_GE(looks(), 3U);
  watch.signal(SIGINT);
  EXPECT_EQ(watch.wait(), 0);
  std::filesystem::remove(seen);
  std::filesystem::remove(seen + ".errors");
}

TEST_F(Plcctl, PostsAsOftenAsAsked) {
  const auto result = run({"post", "event", "line1/ready", "--count", "50", "--interval-us", "100"});
  EXPECT_EQ(result.code, 0) << result.errors;
  EXPECT_THAT(result.output, HasSubstr("50 posted"));
  EXPECT_EQ(event_.counted().count(), 50U);
}

TEST_F(Plcctl, SaysHowManyWerePostedWhenItIsInterrupted) {
  const std::string seen = own_path("post");
  Child post(PLCCTL_PROGRAM,
             {"--domain", std::to_string(domain_.number()), "--timeout", "60", "post", "event", "line1/ready",
              "--count", "1000000", "--interval-us", "1000"},
             seen);
  for (const TimePoint end = soon(); event_.counted().count() < 10 && MonotonicClock::now() < end;) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  post.signal(SIGINT);
  EXPECT_EQ(post.wait(), 1);
  const auto text_of = [](const std::string& path) {
    std::ifstream file(path);
    return std::string{std::istreambuf_iterator<char>(file), {}};
  };
  const std::uint64_t posted = event_.counted().count();
  EXPECT_EQ(text_of(seen), fmt::format("{} posted\n", posted));
  EXPECT_THAT(text_of(seen + ".errors"),
              HasSubstr(fmt::format("interrupted: {} of 1000000 were not posted", 1'000'000 - posted)));
  std::filesystem::remove(seen);
  std::filesystem::remove(seen + ".errors");
}

TEST_F(Plcctl, SuggestsTheNameThatWasMeant) {
  const auto post = run({"post", "event", "line1/raedy"});
  EXPECT_EQ(post.code, 1);
  EXPECT_THAT(post.errors, HasSubstr("did you mean 'line1/ready'?"));
  const auto show = run({"show", "instance", "lin1"});
  EXPECT_EQ(show.code, 1);
  EXPECT_THAT(show.errors, HasSubstr("did you mean 'line1'?"));
  RunResult host;
  for (const char* const timeout : {"1", "5", "20"}) {
    host = run({"--host", "hosat", "--timeout", timeout, "list", "tasks"});
    if (host.errors.contains("those that do: hosta")) break;
  }
  EXPECT_EQ(host.code, 3);
  EXPECT_THAT(host.errors,
              HasSubstr("no host 'hosat' answers (did you mean 'hosta'?); those that do: hosta"));
  const auto stop = run({"stop", "instance", "lin1"});
  EXPECT_EQ(stop.code, 1);
  EXPECT_THAT(stop.errors, HasSubstr("did you mean 'line1'?"));
}

TEST_F(Plcctl, ShowsOneTaskWithItsStatistics) {
  TaskRecorder task(page_->statistics(0), TimePoint{});
  for (int i = 0; i < 50; ++i) {
    const TimePoint release{i * std::chrono::milliseconds(1)};
    task.record({.release = release, .start = release + Duration(3'000), .end = release + Duration(9'000)});
  }
  // The statistics come once a second.
  nlohmann::json json;
  do {
    const auto result = run({"show", "task", "line1/Main", "--json"});
    ASSERT_EQ(result.code, 0) << result.errors;
    json = nlohmann::json::parse(result.output).at(0);
  } while (json["recorded"] != 50);
  EXPECT_EQ(json["interval_us"], 1000.0);
  EXPECT_EQ(json["latency_p99_us"], 3.0);
  EXPECT_EQ(json["exec_avg_us"], 6.0);
  EXPECT_EQ(json["latency_histogram"][0]["count"], 50);
  const auto text = run({"show", "task", "line1/Main"});
  EXPECT_EQ(text.code, 0) << text.errors;
  for (const char* part : {"interval_us", "lost_cycles", "P99.99", "latency:", "execution:", "100.00%"}) {
    EXPECT_THAT(text.output, HasSubstr(part));
  }
}

TEST_F(Plcctl, ResetsTheStatisticsOfOneTaskOrOfAll) {
  EXPECT_EQ(run({"reset", "statistics", "line1/Main"}).code, 0);
  EXPECT_EQ(run({"reset", "statistics", "line1"}).code, 0);
  EXPECT_EQ(run({"reset", "statistics", "line1/"}).code, 2);
  EXPECT_EQ(run({"reset", "statistics", "lin1"}).code, 1);
  const auto requests = host_.requests();
  ASSERT_EQ(requests.size(), 2U);
  EXPECT_EQ(requests[0].verb, ControlVerb::reset_statistics);
  EXPECT_EQ(requests[0].argument, "Main");
  EXPECT_EQ(requests[1].argument, "");
}

TEST_F(Plcctl, SendsTheFileOfAnApplication) {
  const std::string file = host_.run_directory() + "/sent.so";
  std::ofstream(file) << "contents";
  const auto sent = run({"load", "application", "line1", file});
  EXPECT_EQ(sent.code, 0) << sent.errors;
  EXPECT_EQ(sent.errors, "") << "progress is for terminals only";
  ASSERT_EQ(host_.requests().size(), 1U);
  const ControlRequest request = host_.requests()[0];
  EXPECT_EQ(request.verb, ControlVerb::download_application);
  EXPECT_EQ(request.argument, "sent.so");
  EXPECT_EQ(request.options.at("size"), "8");
  EXPECT_EQ(request.options.at("sha256"), "d1b2a59fbea7e20077af9f91b27e95e865061b270be03ff539ab3b73587882e8");
  EXPECT_THAT(request.options.at("from"), HasSubstr("plcctl "));
  EXPECT_FALSE(request.options.contains("boot"));
}

TEST_F(Plcctl, SaysWhichFileItCannotSend) {
  const auto missing = run({"load", "application", "line1", "some/app.so"});
  EXPECT_EQ(missing.code, 1);
  EXPECT_THAT(missing.errors, testing::AllOf(HasSubstr("some/app.so"), HasSubstr("--on-host")));
  EXPECT_THAT(run({"load", "application", "line1", host_.run_directory()}).errors, HasSubstr("is a folder"));
}

TEST_F(Plcctl, NamesTheFileThatItCannotRead) {
  const auto unread = run({"load", "application", "line1", "/proc/self/mem"});
  EXPECT_EQ(unread.code, 1);
  EXPECT_THAT(unread.errors, HasSubstr("cannot read /proc/self/mem"));
  for (const std::vector<std::string>& more : {std::vector<std::string>{}, {"--on-host"}}) {
    std::vector<std::string> words{"load", "application", "line1", ""};
    words.insert(words.end(), more.begin(), more.end());
    const auto unnamed = run(words);
    EXPECT_EQ(unnamed.code, 2);
    EXPECT_THAT(unnamed.errors, HasSubstr("FILE is empty"));
  }
  EXPECT_TRUE(host_.requests().empty());
}

TEST_F(Plcctl, RollsBackAndChoosesTheBootApplication) {
  EXPECT_EQ(run({"rollback", "application", "line1", "--boot"}).code, 0);
  EXPECT_EQ(run({"load", "application", "line1", "/opt/a.so", "--on-host", "--boot"}).code, 0);
  const auto requests = host_.requests();
  ASSERT_EQ(requests.size(), 2U);
  EXPECT_EQ(requests[0].verb, ControlVerb::rollback_application);
  EXPECT_EQ(requests[0].options.at("boot"), "yes");
  EXPECT_EQ(requests[1].verb, ControlVerb::load_application);
  EXPECT_EQ(requests[1].options.at("boot"), "yes");
}

TEST_F(Plcctl, MakesAFileOnTheHostAbsolute) {
  EXPECT_EQ(run({"load", "application", "line1", "some/app.so", "--on-host"}).code, 0);
  ASSERT_EQ(host_.requests().size(), 1U);
  EXPECT_EQ(host_.requests()[0].argument.front(), '/');
  EXPECT_THAT(host_.requests()[0].argument, testing::EndsWith("/some/app.so"));
}

TEST_F(Plcctl, PassesEachVerbOn) {
  EXPECT_EQ(run({"set", "scheduler", "line1", "CmpScheduleOneShot"}).code, 0);
  EXPECT_EQ(run({"register", "event", "line1/e/2"}).code, 1) << "a slash is not allowed in an event's name";
  EXPECT_EQ(run({"unregister", "event", "line1/e2"}).code, 0);
  EXPECT_EQ(run({"restart", "instance", "line1"}).code, 0);
  const auto requests = host_.requests();
  ASSERT_EQ(requests.size(), 3U);
  EXPECT_EQ(requests[0].verb, ControlVerb::set_scheduler);
  EXPECT_EQ(requests[1].verb, ControlVerb::unregister_event);
  EXPECT_EQ(requests[1].argument, "e2");
  EXPECT_EQ(requests[2].verb, ControlVerb::restart);
}

TEST_F(Plcctl, WatchesAsOftenAsAsked) {
  const auto result = run({"watch", "tasks", "line1", "--interval", "0.1", "--count", "3"});
  EXPECT_EQ(result.code, 0) << result.errors;
  std::size_t blocks = 0;
  for (auto at = result.output.find("INSTANCE"); at != std::string::npos;
       at = result.output.find("INSTANCE", at + 1)) {
    ++blocks;
  }
  EXPECT_EQ(blocks, 3U);
}

TEST_F(Plcctl, WatchesNothingThatThereIsNot) {
  for (const char* const what : {"tasks", "transitions"}) {
    // Without an end of its own, a watch would last as long as the test.
    const auto refused = run({"watch", what, "lin1", "--count", "1"});
    EXPECT_EQ(refused.code, 1) << what;
    EXPECT_THAT(refused.errors, HasSubstr("did you mean 'line1'?"));
  }
}

TEST_F(Plcctl, AsksForTheNameOfAnObject) {
  for (const char* const verb : {"show", "watch"}) {
    const auto unnamed = run({verb, "object", ""});
    EXPECT_EQ(unnamed.code, 2) << verb;
    EXPECT_THAT(unnamed.errors, HasSubstr("NAME is empty"));
  }
}

TEST_F(Plcctl, EndsAllForcesOnlyWhereAllIsSaid) {
  const auto pattern = run({"unforce", "variable", "line1", "Main.a", "*"});
  EXPECT_EQ(pattern.code, 2);
  EXPECT_THAT(pattern.errors, HasSubstr("--all"));
  EXPECT_TRUE(host_.requests().empty());
  EXPECT_EQ(run({"unforce", "variable", "line1", "--all"}).code, 0);
  ASSERT_EQ(host_.requests().size(), 1U);
  EXPECT_EQ(host_.requests()[0].argument, "*");
}

TEST_F(Plcctl, AsksWhichHostWhenThereAreSeveral) {
  TestHost other(domain_, "hostb");
  other.start_server();
  RunResult result;
  while (result.code != 2) result = run({"stop", "instance", "line1"});
  EXPECT_THAT(result.errors, testing::AllOf(HasSubstr("--host"), HasSubstr("hosta, hostb")));
  EXPECT_EQ(run({"--host", "hosta", "stop", "instance", "line1"}).code, 0);
}

TEST(PlcctlAlone, SaysThatNoHostAnswers) {
  const OwnDomain domain;
  const auto result = run_plcctl(domain.number(), {"list", "instances", "--timeout", "0.3"});
  EXPECT_EQ(result.code, 3);
  EXPECT_THAT(result.errors, HasSubstr("domain " + std::to_string(domain.number())));
}

TEST(PlcctlAlone, RefusesWhatItDoesNotKnow) {
  const auto result = run_plcctl(1, {"lst", "instances"});
  EXPECT_EQ(result.code, 2);
  EXPECT_EQ(run_plcctl(1, {"list"}).code, 2);
  EXPECT_EQ(run_plcctl(1, {"post", "event", "noslash"}).code, 2);
  EXPECT_EQ(run_plcctl(1, {"post", "event", "a/b", "--count", "0"}).code, 2);
}

TEST(PlcctlAlone, MakesNoIdentitiesInAFolderWithoutAName) {
  const auto unnamed = run_plcctl(1, {"security", "init", ""});
  EXPECT_EQ(unnamed.code, 2);
  EXPECT_THAT(unnamed.errors, HasSubstr("DIR is empty"));
}

}  // namespace
}  // namespace plchost
