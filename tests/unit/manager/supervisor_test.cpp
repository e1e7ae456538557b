#include "manager/supervisor/supervisor.hpp"

#include <csignal>
#include <map>
#include <string>
#include <vector>

#include <gmock/gmock.h>

#include "tests/unit/manager/fake_host.hpp"
#include "tests/unit/manager/fake_keeper.hpp"
#include "tests/unit/manager/fake_observer.hpp"
#include "tests/unit/manager/fake_wishes.hpp"

namespace plchost {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

/// line1 after drive1, packer1 after line1 and drive1.
class SupervisorTest : public testing::Test {
 protected:
  SupervisorTest() {
    add("packer1", {"line1", "drive1"});
    add("line1", {"drive1"});
    add("drive1", {});
  }

  void add(const std::string& name, std::vector<std::string> after) {
    InstanceConfig instance;
    instance.name = name;
    instance.core = 1;
    instance.application = "/opt/" + name + ".so";
    instance.after = std::move(after);
    config_.instances.push_back(instance);
  }

  void make() {
    sut_.emplace(config_.instances,
                 ManagedInstance::Surroundings{.host = config_.host,
                                               .folder = "/etc",
                                               .schedulers = {"CmpSchedule"},
                                               .now = [this] { return now_; },
                                               .observer = observer_},
                 [this](const InstanceConfig& config) {
                   auto host = std::make_unique<FakeHost>();
                   hosts_[config.name] = host.get();
                   auto wishes = std::make_unique<FakeWishes>();
                   wishes_[config.name] = wishes.get();
                   return Supervisor::HostedInstance{.host = std::move(host),
                                                     .applications = std::make_unique<FakeKeeper>(),
                                                     .wishes = std::move(wishes),
                                                     .connect = [](InstanceEvents&) {}};
                 });
  }
  ManagedInstance& instance(const std::string& name) {
    for (std::size_t i = 0; i < sut_->size(); ++i) {
      if (sut_->instance(i).config().name == name) return sut_->instance(i);
    }
    throw std::out_of_range(name);
  }
  InstanceState state(const std::string& name) { return instance(name).status().state; }
  std::string problem(const std::string& name) { return std::string(instance(name).status().problem.view()); }
  void ready(const std::string& name) {
    instance(name).on_report({.step = SetupStep::ready, .code = ErrorCode::ok, .text = ""});
  }
  void start_all() {
    make();
    sut_->start();
    for (const char* name : {"drive1", "line1", "packer1"}) ready(name);
  }

  ManagerConfig config_;
  TimePoint now_{std::chrono::seconds(1)};
  std::map<std::string, FakeHost*> hosts_;
  std::map<std::string, FakeWishes*> wishes_;
  FakeObserver observer_;
  std::optional<Supervisor> sut_;
};

TEST_F(SupervisorTest, StartsEachWhenWhatItComesAfterIsUp) {
  make();
  sut_->start();
  EXPECT_EQ(state("drive1"), InstanceState::starting);
  EXPECT_EQ(state("line1"), InstanceState::waiting);
  EXPECT_EQ(problem("line1"), "waits for 'drive1', which is starting");
  EXPECT_EQ(problem("packer1"), "waits for 'line1', which is waiting, 'drive1', which is starting");
  ready("drive1");
  EXPECT_EQ(state("line1"), InstanceState::starting);
  EXPECT_EQ(state("packer1"), InstanceState::waiting);
  ready("line1");
  EXPECT_EQ(state("packer1"), InstanceState::starting);
  ready("packer1");
  EXPECT_EQ(observer_.shown.at(0).state, InstanceState::running);
}

TEST_F(SupervisorTest, LeavesTheOthersWaitingWhenOneFails) {
  make();
  sut_->start();
  instance("drive1").on_report({.step = SetupStep::bind_core, .code = ErrorCode::system, .text = "no core"});
  instance("drive1").on_exit(exited_with(kExitSetupFailed));
  EXPECT_EQ(state("line1"), InstanceState::waiting);
  EXPECT_EQ(problem("line1"), "waits for 'drive1', which is failed (exit code 3: bind core: no core)");
}

TEST_F(SupervisorTest, GoesOnWhenAnOperatorStartsWhatFailed) {
  make();
  sut_->start();
  instance("drive1").on_exit(exited_with(kExitSetupFailed));
  sut_->handle({.number = 1, .verb = ControlVerb::start, .instance = "drive1", .argument = ""},
               [](const ControlReply&) {});
  ready("drive1");
  EXPECT_EQ(state("line1"), InstanceState::starting);
}

TEST_F(SupervisorTest, LeavesAloneWhatShallNotStartByItself) {
  config_.instances[2].autostart = false;
  make();
  sut_->start();
  EXPECT_EQ(state("drive1"), InstanceState::offline);
  EXPECT_TRUE(hosts_["drive1"]->spawned.empty());
  EXPECT_THAT(problem("line1"), HasSubstr("waits for 'drive1', which is offline"));
}

TEST_F(SupervisorTest, CountsWhatWasAdoptedAsUp) {
  make();
  hosts_["drive1"]->adoptable = 5;
  InstanceRuntime& page = hosts_["drive1"]->page.emplace();
  page.pid = 5;
  page.application.assign("/opt/drive.so");
  sut_->start();
  EXPECT_EQ(state("line1"), InstanceState::waiting);
  instance("drive1").on_reply(
      {.number = hosts_["drive1"]->requests.back().number, .code = ErrorCode::ok, .text = ""});
  EXPECT_EQ(state("line1"), InstanceState::starting);
}

TEST_F(SupervisorTest, DoesNotDisturbOthersWhenOneCrashes) {
  start_all();
  instance("drive1").on_exit(killed_by(SIGKILL));
  EXPECT_EQ(state("drive1"), InstanceState::waiting);
  EXPECT_EQ(state("line1"), InstanceState::running);
  EXPECT_EQ(state("packer1"), InstanceState::running);
  EXPECT_TRUE(hosts_["line1"]->requests.empty());
}

TEST_F(SupervisorTest, EndsInReverseOrder) {
  start_all();
  bool done = false;
  sut_->shut_down([&] { done = true; });
  EXPECT_EQ(state("packer1"), InstanceState::stopping);
  EXPECT_EQ(state("line1"), InstanceState::running);
  instance("packer1").on_exit(exited_with(0));
  EXPECT_EQ(state("line1"), InstanceState::stopping);
  EXPECT_EQ(state("drive1"), InstanceState::running);
  instance("line1").on_exit(exited_with(0));
  EXPECT_FALSE(done);
  instance("drive1").on_exit(exited_with(0));
  EXPECT_TRUE(done);
  EXPECT_EQ(state("drive1"), InstanceState::offline);
}

TEST_F(SupervisorTest, StartsNothingWhileItEnds) {
  make();
  sut_->start();
  bool done = false;
  sut_->shut_down([&] { done = true; });
  EXPECT_EQ(state("line1"), InstanceState::offline);
  instance("drive1").on_exit(killed_by(SIGKILL));
  EXPECT_TRUE(done);
  EXPECT_TRUE(hosts_["line1"]->spawned.empty());
}

TEST_F(SupervisorTest, EndsAtOnceWhenNothingRuns) {
  make();
  bool done = false;
  sut_->shut_down([&] { done = true; });
  EXPECT_TRUE(done);
}

TEST_F(SupervisorTest, NamesTheInstancesThatThereAre) {
  make();
  ControlReply reply;
  sut_->handle({.number = 3, .verb = ControlVerb::stop, .instance = "x", .argument = ""},
               [&](const ControlReply& got) { reply = got; });
  EXPECT_EQ(reply.number, 3U);
  EXPECT_EQ(reply.code, ErrorCode::not_found);
  EXPECT_EQ(reply.text, "no instance 'x'; there are packer1, line1, drive1");
}

TEST_F(SupervisorTest, KeepsThePlaceOfEachInstanceWhenOthersComeAndGo) {
  start_all();
  std::vector<InstanceConfig> now = config_.instances;
  std::erase_if(now, [](const InstanceConfig& instance) { return instance.name == "packer1"; });
  InstanceConfig spare;
  spare.name = "spare";
  spare.core = 1;
  spare.after = {"drive1"};
  now.push_back(spare);
  EXPECT_THAT(sut_->reload(now), ElementsAre("instance 'packer1': removed; it runs until it is stopped",
                                             "instance 'spare': new"));
  EXPECT_EQ(observer_.shown.at(3).name.view(), "spare");
  EXPECT_EQ(state("spare"), InstanceState::starting) << "drive1 is up";
  instance("packer1").on_exit(killed_by(SIGSEGV));
  wishes_["packer1"]->writing = true;
  sut_->refresh();
  now_ += kGoneShown;
  sut_->refresh();
  EXPECT_TRUE(observer_.ended.empty()) << "its wish is being written";
  wishes_["packer1"]->writing = false;
  sut_->refresh();
  now_ += kGoneShown;
  sut_->refresh();
  EXPECT_EQ(observer_.ended.at(0), "packer1");
  spare.name = "next";
  now.push_back(spare);
  EXPECT_THAT(sut_->reload(now), ElementsAre("instance 'next': new"));
  EXPECT_EQ(observer_.shown.at(0).name.view(), "next");
  EXPECT_EQ(observer_.shown.at(1).name.view(), "line1");
}

TEST_F(SupervisorTest, TellsWhichInstancesRunADebugBuildWhenTheyAreAllowedNoLongerOrAgain) {
  start_all();
  hosts_["line1"]->debug_build = hosts_["packer1"]->debug_build = true;
  instance("packer1").on_exit(exited_with(0));
  config_.host.allow_debug = false;
  EXPECT_THAT(
      sut_->tell_debug_builds(),
      ElementsAre("instance 'line1': runs a debug build; it runs on, sets no new breakpoints, and its "
                  "next start or load of such a build is refused"));
  EXPECT_EQ(state("line1"), InstanceState::running);
  config_.host.allow_debug = true;
  EXPECT_THAT(sut_->tell_debug_builds(),
              ElementsAre("instance 'line1': runs a debug build; a debugger can halt its tasks again"));
}

TEST_F(SupervisorTest, HasRoomForAsManyAsThePageHas) {
  start_all();
  std::vector<InstanceConfig> now(kMaxInstances - 2);
  for (std::size_t i = 0; i < now.size(); ++i) now[i].name = "new" + std::to_string(i);
  const auto full = sut_->check_room(now);
  ASSERT_FALSE(full);
  EXPECT_EQ(full.error().code, ErrorCode::full);
  EXPECT_THAT(full.error().message, HasSubstr("3 instances are removed and 62 would be configured"));
  now.pop_back();
  EXPECT_TRUE(sut_->check_room(now));
}

}  // namespace
}  // namespace plchost
