#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include <gmock/gmock.h>

#include "manager/supervisor/managed_instance.hpp"
#include "tests/unit/manager/fake_host.hpp"
#include "tests/unit/manager/fake_keeper.hpp"
#include "tests/unit/manager/fake_observer.hpp"
#include "tests/unit/manager/fake_wishes.hpp"

namespace plchost {

class ManagedInstanceTest : public testing::Test {
 protected:
  ManagedInstanceTest() {
    config_.name = "line1";
    config_.core = 1;
    config_.application = "/opt/line.so";
    config_.crash_limit = 3;
    config_.crash_window = std::chrono::seconds(10);
    host_config_.pool = "pool";
    host_config_.run_directory = "/run/x";
    make();
  }

  void make() {
    sut_.emplace(config_, surroundings_,
                 ManagedInstance::Own{.host = host_, .applications = applications_, .wishes = wishes_});
  }

  ManagedInstance& sut() { return *sut_; }
  InstanceState state() { return sut().status().state; }
  std::string problem() { return std::string(sut().status().problem.view()); }
  void advance(Duration duration) { now_ += duration; }
  void expire_timer() {
    ASSERT_TRUE(host_.timer.has_value());
    now_ = std::max(now_, *host_.timer);
    host_.timer.reset();
    sut().on_timer();
  }
  void report_ready() { sut().on_report({.step = SetupStep::ready, .code = ErrorCode::ok, .text = ""}); }
  void bring_up() {
    sut().hold("is to be started");
    sut().release();
    report_ready();
    ASSERT_EQ(state(), InstanceState::running);
  }
  void bring_up_stopped() {
    ask(ControlVerb::reset);
    report_ready();
    take_reply();
    ASSERT_EQ(state(), InstanceState::stopped);
  }
  void ask(ControlVerb verb, const std::string& argument = "",
           const std::map<std::string, std::string>& options = {}) {
    sut().handle({.number = 7, .verb = verb, .instance = "line1", .argument = argument, .options = options},
                 [this](const ControlReply& reply) { replies_.push_back(reply); });
  }
  /// `limit_ns`: the client's time limit, as ControlRequest has it.
  void ask_until(std::int64_t limit_ns, ControlVerb verb) {
    ControlRequest request;
    request.number = 7;
    request.verb = verb;
    request.instance = "line1";
    request.limit_ns = limit_ns;
    sut().handle(request, [this](const ControlReply& reply) { replies_.push_back(reply); });
  }
  /// The one reply that came; there must be one.
  ControlReply take_reply() {
    EXPECT_EQ(replies_.size(), 1U);
    if (replies_.empty()) return {.number = 0, .code = ErrorCode::system, .text = "no reply came"};
    ControlReply reply = replies_.back();
    replies_.clear();
    return reply;
  }
  void answer(ErrorCode code = ErrorCode::ok, const std::string& text = "") {
    ASSERT_FALSE(host_.requests.empty());
    sut().on_reply({.number = host_.requests.back().number, .code = code, .text = text});
  }
  /// The words of that process about itself.
  [[nodiscard]] InstanceReport report_of(std::int32_t pid, ApplicationState said) const {
    return {.pid = pid,
            .state = std::to_underlying(said),
            .problem = said == ApplicationState::exception ? "task 'A'" : "",
            .application = config_.application,
            .scheduler = "CmpSchedule",
            .cores = {1},
            .memory_locked = true};
  }
  void crash_once() {
    sut().on_exit(killed_by(SIGSEGV));
    ASSERT_EQ(state(), InstanceState::waiting);
    expire_timer();
    report_ready();
  }
  void reach_safe_mode() {
    bring_up();
    for (int i = 0; i < 3; ++i) crash_once();
    ASSERT_EQ(state(), InstanceState::safe_mode);
  }

  InstanceConfig config_;
  HostConfig host_config_;
  FakeHost host_;
  FakeKeeper applications_;
  FakeWishes wishes_;
  TimePoint now_{std::chrono::seconds(1000)};
  FakeObserver observer_;
  const ManagedInstance::Surroundings surroundings_{.host = host_config_,
                                                    .folder = "/etc/plchost",
                                                    .schedulers = {"CmpSchedule", "CmpScheduleTimer"},
                                                    .now = [this] { return now_; },
                                                    .observer = observer_};
  std::vector<ControlReply> replies_;
  std::optional<ManagedInstance> sut_;
};

}  // namespace plchost
