// Each row of the table of phases is a step that an instance takes, and each trigger of the row leads to it.
#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <set>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "tests/unit/manager/managed_instance_fixture.hpp"

namespace plchost {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::ElementsAre;
using testing::HasSubstr;

class PhaseSteps;

/// A trigger of a row, as the row says it.
struct PhasePlay {
  InstancePhase from;
  InstancePhase to;
  const char* trigger;
  void (PhaseSteps::*before)();  // to `from`
  void (PhaseSteps::*step)();
};

class PhaseSteps : public ManagedInstanceTest, public testing::WithParamInterface<PhasePlay> {
 public:
  static const std::vector<PhasePlay>& all();

 protected:
  // Before the step. `left_...`: its manager has ended, and the next one knows its wish.
  void begin() {}
  void hold() { sut().hold("is to be started"); }
  void lack_processes() { lack(EAGAIN); }
  void hold_without_processes() {
    hold();
    lack(EAGAIN);
  }
  void hold_without_program() {
    hold();
    lack(ENOENT);
  }
  void set_up() {
    hold();
    sut().release();
  }
  void set_up_with_a_task_caught() {
    host_.lost_fault = "task 'Main': SIGABRT: abort";
    set_up();
    sut().on_report({.step = SetupStep::make_tasks, .code = ErrorCode::ok, .text = ""});
  }
  void back_off() {
    set_up();
    crash();
  }
  void back_off_without_program() {
    back_off();
    lack(ENOENT);
  }
  void back_off_for_the_name() {
    set_up();
    sut().on_report({.step = SetupStep::attach_pool, .code = ErrorCode::already_exists, .text = "it runs"});
    refuse();
    host_.adoptable = 77;
  }
  void never_again() { config_.restart = RestartPolicy::never; }
  void run() { bring_up(); }
  void run_once() {
    never_again();
    make();
    bring_up();
  }
  void end() {
    bring_up();
    reset();
  }
  void end_for_good() {
    bring_up();
    end_manager();
  }
  void end_without_processes() {
    end();
    lack(EAGAIN);
  }
  void left_alone() {
    bring_up();
    make();
  }
  void left_in_set_up() {
    never_again();
    make();
    set_up();
    make();
  }
  void left_up() {
    host_.adoptable = 77;
    left_alone();
  }
  void left_ending() {
    host_.adoptable = 77;
    end();
    make();
  }
  void adopt_one() {
    left_up();
    find();
  }
  void adopt_once() {
    never_again();
    adopt_one();
  }
  void adopt_in_a_load() {
    left_up();
    wishes_.wish->application_before = "/opt/earlier.so";
    wishes_.wish->process = InstanceWish::Process::setting_up;
    make();
    find();
  }

  // The step.
  void find() { ASSERT_TRUE(sut().adopt()); }
  void go_on() { sut().resume(); }
  void release() { sut().release(); }
  void start() { ask(ControlVerb::start); }
  void stop() { ask(ControlVerb::stop); }
  void reset() { ask(ControlVerb::reset); }
  void remove() {
    sut().remove();
    sut().refresh();
  }
  void remove_and_stop() {
    remove();
    stop();
  }
  void end_manager() { sut().shut_down(); }
  void reach_time() { expire_timer(); }
  void report() { report_ready(); }
  void crash() { sut().on_exit(killed_by(SIGSEGV)); }
  void refuse() { sut().on_exit(exited_with(kExitSetupFailed)); }
  void exit() { sut().on_exit(exited_with(0)); }
  void say_state() { answer(ErrorCode::ok, encode(report_of(77, ApplicationState::running))); }
  void say_nothing() {  // as the reactor does it: a look each 50 ms, and the timer
    for (Duration passed{}; passed < kAdoptLimit + seconds(1); passed += milliseconds(50)) {
      advance(milliseconds(50));
      sut().refresh();
      if (host_.timer && *host_.timer <= now_) expire_timer();
    }
  }

 private:
  void lack(int number) {
    host_.can_spawn = false;
    host_.spawn_errno = number;
  }
};

const std::vector<PhasePlay>& PhaseSteps::all() {
  using enum InstancePhase;
  using Of = PhaseSteps;
  // clang-format off
  static const std::vector<PhasePlay> plays{
      {down,        held,        "to start in the order of `after`",    &Of::begin,                     &Of::go_on},
      {down,        backing_off, "its process ended unwatched",         &Of::left_alone,                &Of::go_on},
      {down,        backing_off, "may still come up",                   &Of::left_in_set_up,            &Of::go_on},
      {down,        backing_off, "cannot be made",                      &Of::lack_processes,            &Of::start},
      {down,        setting_up,  "an operator starts it",               &Of::begin,                     &Of::start},
      {down,        adopting,    "a process has outlived its manager",  &Of::left_up,                   &Of::find},
      {down,        ending,      "which had asked it to end",           &Of::left_ending,               &Of::find},
      {held,        down,        "it is stopped",                       &Of::hold,                      &Of::stop},
      {held,        down,        "or removed",                          &Of::hold,                      &Of::remove},
      {held,        down,        "cannot be started",                   &Of::hold_without_program,      &Of::release},
      {held,        down,        "its manager ends",                    &Of::hold,                      &Of::end_manager},
      {held,        backing_off, "its process cannot be made yet",      &Of::hold_without_processes,    &Of::release},
      {held,        setting_up,  "the instances of `after` are up",     &Of::hold,                      &Of::release},
      {held,        setting_up,  "an operator starts it",               &Of::hold,                      &Of::start},
      {backing_off, down,        "it is stopped",                       &Of::back_off,                  &Of::stop},
      {backing_off, down,        "removed",                             &Of::back_off,                  &Of::remove},
      {backing_off, down,        "given up",                            &Of::back_off_without_program,  &Of::reach_time},
      {backing_off, down,        "its manager ends",                    &Of::back_off,                  &Of::end_manager},
      {backing_off, setting_up,  "the time is over",                    &Of::back_off,                  &Of::reach_time},
      {backing_off, setting_up,  "an operator starts it",               &Of::back_off,                  &Of::start},
      {backing_off, adopting,    "a process of its name is there",      &Of::back_off_for_the_name,     &Of::reach_time},
      {setting_up,  down,        "no other is to start",                &Of::set_up,                    &Of::refuse},
      {setting_up,  backing_off, "another is to start",                 &Of::set_up,                    &Of::crash},
      {setting_up,  up,          "its process reports that it is ready", &Of::set_up,                   &Of::report},
      {setting_up,  up,          "a fault keeps it from that",          &Of::set_up_with_a_task_caught, &Of::say_nothing},
      {setting_up,  ending,      "its process is replaced",             &Of::set_up,                    &Of::reset},
      {setting_up,  ending,      "it is removed",                       &Of::set_up,                    &Of::remove_and_stop},
      {setting_up,  ending,      "its manager ends",                    &Of::set_up,                    &Of::end_manager},
      {adopting,    down,        "no other is to start",                &Of::adopt_once,                &Of::crash},
      {adopting,    backing_off, "another is to start",                 &Of::adopt_one,                 &Of::crash},
      {adopting,    setting_up,  "the application before starts",       &Of::adopt_in_a_load,           &Of::refuse},
      {adopting,    up,          "its process answers",                 &Of::adopt_one,                 &Of::say_state},
      {adopting,    up,          "the limit is over",                   &Of::adopt_one,                 &Of::say_nothing},
      {adopting,    ending,      "its process is replaced",             &Of::adopt_one,                 &Of::reset},
      {adopting,    ending,      "it is removed",                       &Of::adopt_one,                 &Of::remove_and_stop},
      {adopting,    ending,      "its manager ends",                    &Of::adopt_one,                 &Of::end_manager},
      {up,          down,        "no other is to start",                &Of::run_once,                  &Of::crash},
      {up,          backing_off, "another is to start",                 &Of::run,                       &Of::crash},
      {up,          ending,      "its process is replaced",             &Of::run,                       &Of::reset},
      {up,          ending,      "it is removed",                       &Of::run,                       &Of::remove_and_stop},
      {up,          ending,      "its manager ends",                    &Of::run,                       &Of::end_manager},
      {ending,      down,        "no other is to start",                &Of::end_for_good,              &Of::exit},
      {ending,      backing_off, "the next one cannot be made yet",     &Of::end_without_processes,     &Of::exit},
      {ending,      setting_up,  "the next one starts",                 &Of::end,                       &Of::exit},
  };
  // clang-format on
  return plays;
}

TEST_P(PhaseSteps, AreTakenAsTheirTriggersSay) {
  const PhasePlay& play = GetParam();
  const auto row = std::ranges::find_if(
      phase_steps(), [&](const PhaseStep& step) { return step.from == play.from && step.to == play.to; });
  ASSERT_NE(row, phase_steps().end()) << "the table has no such step";
  EXPECT_THAT(std::string(row->trigger), HasSubstr(play.trigger));
  (this->*play.before)();
  observer_.steps.clear();
  (this->*play.step)();
  EXPECT_THAT(observer_.steps, ElementsAre(std::pair(play.from, play.to)));
}

std::string name_of(const testing::TestParamInfo<PhasePlay>& play) {
  std::string name =
      fmt::format("{}_{}_{}", to_string(play.param.from), to_string(play.param.to), play.index);
  std::ranges::replace(name, ' ', '_');
  return name;
}
INSTANTIATE_TEST_SUITE_P(Each, PhaseSteps, testing::ValuesIn(PhaseSteps::all()), name_of);

// With the test above: no row is dead.
TEST(InstancePhase, EachStepOfItsTableIsPlayed) {
  std::set<std::pair<InstancePhase, InstancePhase>> played;
  for (const PhasePlay& play : PhaseSteps::all()) played.emplace(play.from, play.to);
  for (const PhaseStep& step : phase_steps()) {
    EXPECT_TRUE(played.contains({step.from, step.to}))
        << fmt::format("no play leads from '{}' to '{}'", to_string(step.from), to_string(step.to));
  }
}

}  // namespace
}  // namespace plchost
