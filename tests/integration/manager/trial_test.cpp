// The trial finds each fault that a start would find: the machine that runs, runs on, and the answer says
// why.

#include <filesystem>
#include <string>

#include <gmock/gmock.h>

#include "shm/block_driver/node_directory.hpp"
#include "shm/pool/object_pool.hpp"
#include "shm/threads/thread.hpp"
#include "tests/integration/manager/plant.hpp"

namespace plchost {
namespace {

using testing::AllOf;
using testing::HasSubstr;

class Trial : public testing::Test {
 protected:
  void start(const std::string& application, const std::string& settings = "") {
    plant_.write_file("line1.cfg", settings);
    plant_.add("line1", application, "settings = \"line1.cfg\"");
    plant_.start_manager();
    ASSERT_TRUE(plant_.wait_for("line1", InstanceState::running));
    pid_ = plant_.status("line1").pid;
  }
  /// Why `application` is refused; the running one must not be touched.
  std::string refusal(const std::string& application) {
    const auto reply = plant_.ask(ControlVerb::load_application, "line1", Plant::application(application));
    EXPECT_NE(reply.code, ErrorCode::ok);
    EXPECT_EQ(plant_.status("line1").pid, pid_);
    EXPECT_EQ(plant_.status("line1").state, InstanceState::running);
    EXPECT_TRUE(plant_.wait_for_cycles("line1"));
    return reply.text;
  }

  /// The pool has 64 places, and others have taken all that line1 left: name_of(0), name_of(1), and so on.
  Result<ObjectPool> start_with_full_pool() {
    plant_.set_host_keys("pool_objects = 64");
    start("manager_chatter");
    auto pool = ObjectPool::attach(plant_.pool());
    int made = 0;
    while (pool && pool->create_semaphore(name_of(made), 1, {.keep = true})) ++made;
    EXPECT_GT(made, 3);
    return pool;
  }
  static std::string name_of(int number) { return "others/" + std::to_string(number); }

  Plant plant_;
  int pid_ = 0;
};

TEST_F(Trial, FindsAComponentThatIsNotThere) {
  start("bottling_line");
  plant_.write_file("line1.cfg", "[ComponentManager]\nComponent.1=gone.so\n");
  EXPECT_THAT(refusal("packer"), AllOf(HasSubstr("component"), HasSubstr("gone.so")));
}

TEST_F(Trial, FindsAMemoryOfThePoolThatHasAnotherSize) {
  start("bottling_line");
  auto pool = ObjectPool::attach(plant_.pool());
  ASSERT_TRUE(pool);
  ASSERT_TRUE(pool->create_memory("io.data", 4, {.keep = true}));
  plant_.write_file(
      "line1.cfg", "[SysMem]\nLinux.Area.0.Flags=0x8000\nLinux.Area.0.Object=io.data\nLinux.Area.0.Size=8\n");
  EXPECT_THAT(refusal("areas"), AllOf(HasSubstr("line1.cfg:2: [SysMem] Area.0"), HasSubstr("io.data"),
                                      HasSubstr("4 bytes"), HasSubstr("8")));
  ASSERT_TRUE(pool->create_semaphore("io.other", 1, {.keep = true}));
  plant_.write_file(
      "line1.cfg",
      "[SysMem]\nLinux.Area.0.Flags=0x8000\nLinux.Area.0.Object=io.other\nLinux.Area.0.Size=8\n");
  EXPECT_THAT(refusal("areas"), HasSubstr("'io.other' is no shared memory"));
}

TEST_F(Trial, FindsADeviceThatIsNotThereOrTooSmall) {
  start("bottling_line");
  const std::string area =
      "[SysMem]\nLinux.Area.0.Flags=0x8000\nLinux.Area.0.Address=0\nLinux.Area.0.Size=8\n";
  plant_.write_file("line1.cfg", area + "Linux.Area.0.Device=/dev/none\n");
  EXPECT_THAT(refusal("areas"), HasSubstr("of /dev/none: cannot be opened"));
  plant_.write_file("small", "1234");
  plant_.write_file("line1.cfg", area + "Linux.Area.0.Device=" + plant_.state_directory() + "/../small\n");
  EXPECT_THAT(refusal("areas"), HasSubstr("the file ends at 0x4"));
}

TEST_F(Trial, FindsKeptValuesOfAnotherLayoutThatTheSettingsRefuse) {
  start("areas", "[Retain]\nMismatch=Refuse\n");
  EXPECT_THAT(refusal("areas_other"), HasSubstr("another layout"));
  EXPECT_TRUE(std::filesystem::exists(plant_.state_directory()));
  plant_.write_file("line1.cfg", "[Retain]\nMismatch=Ignore\n");
  const auto reply = plant_.ask(ControlVerb::load_application, "line1", Plant::application("areas_other"));
  EXPECT_EQ(reply.code, ErrorCode::ok) << reply.text;
}

TEST_F(Trial, FindsAComponentThatSaysItCannotBeInitialised) {
  start("bottling_line");
  plant_.write_file("line1.cfg", "[ComponentManager]\nComponent.1=" +
                                     Plant::application("manager_unready_component") + "\n");
  EXPECT_THAT(refusal("packer"),
              AllOf(HasSubstr("manager_unready_component.so"), HasSubstr("its hook CH_TRIAL returned 0x")));
}

// No trial finds it: the component fails in CH_INIT only. The settings that name it are not those of the
// application that ran.
TEST_F(Trial, IsTakenBackForAComponentThatFailsInTheStartOnly) {
  start("bottling_line");
  const std::string component = Plant::application("manager_late_component");
  plant_.write_file("line1.cfg", "[ComponentManager]\nComponent.1=" + component + "\n");
  const auto reply = plant_.ask(ControlVerb::load_application, "line1", Plant::application("packer"));
  EXPECT_EQ(reply.code, ErrorCode::unavailable);
  EXPECT_THAT(reply.text,
              AllOf(HasSubstr("packer.so does not come up"), HasSubstr("its hook CH_INIT returned"),
                    HasSubstr("which was loaded before, is started again")));
  ASSERT_TRUE(plant_.wait_for("line1", InstanceState::running));
  const InstanceStatus status = plant_.status("line1");
  EXPECT_NE(status.pid, pid_);
  EXPECT_EQ(status.application.view(), Plant::application("bottling_line"));
  EXPECT_THAT(std::string(status.problem.view()), HasSubstr("packer.so does not come up"));
  EXPECT_THAT(plant_.log(),
              HasSubstr("bottling_line.so is started again with the settings that it ran with"));
  EXPECT_TRUE(plant_.wait_for_cycles("line1"));
  plant_.kill_instances();
  EXPECT_TRUE(Plant::eventually([&] {
    const auto now = plant_.status("line1");
    return now.state == InstanceState::running && now.pid != status.pid;
  })) << "the settings of then hold until somebody mends the file";
  plant_.write_file("line1.cfg", "");
  EXPECT_EQ(plant_.ask(ControlVerb::restart, "line1").code, ErrorCode::ok);
  EXPECT_EQ(plant_.status("line1").problem.view(), "");
}

TEST_F(Trial, FindsANodeAddressThatAnotherProcessHas) {
  start("bottling_line");
  auto directory = NodeDirectory::open(plant_.pool());
  ASSERT_TRUE(directory);
  const auto life = directory->join({.name = "firmware", .forced_address = 7});
  ASSERT_TRUE(life) << life.error().describe();
  plant_.write_file("line1.cfg", "[CmpBlkDrvShm]\nForcedAddress=7\n");
  EXPECT_THAT(refusal("packer"), HasSubstr("node address 7 is taken: node 'firmware'"));
  directory->leave(*life);
  const auto reply = plant_.ask(ControlVerb::load_application, "line1", Plant::application("packer"));
  EXPECT_EQ(reply.code, ErrorCode::ok) << reply.text;
  NodeDirectory::remove(plant_.pool());
}

TEST_F(Trial, FindsAFunctionThatIsNoClock) {
  start("bottling_line");
  plant_.write_file(
      "line1.cfg",
      "[SysTime]\nLinux.CustomSysTimeGetUs=MySysTimeGetUs\nLinux.CustomSysTimeGetNs=OtherBaseNs\n"
      "Linux.CustomSysTimeLibrary=" +
          Plant::application("clocks") + "\n");
  EXPECT_THAT(refusal("packer"), HasSubstr("have no common base"));
}

TEST_F(Trial, FindsATaskThatItsSettingsDoNotFit) {
  start("bottling_line");
  plant_.write_file("line1.cfg", "[Task.Position]\nStartOffsetNs=4000000000\n");
  EXPECT_THAT(refusal("drive_axis"), AllOf(HasSubstr("task 'Position'"), HasSubstr("its start offset of")));
}

TEST_F(Trial, FindsAThreadThatTakesTheProcessorInTheSetUp) {
  if (!Thread::start("probe", {.fifo = 1}, [] {})) GTEST_SKIP() << "no right to SCHED_FIFO";
  start("bottling_line");
  EXPECT_THAT(refusal("manager_setup_hog"),
              HasSubstr("in the set-up, thread 'hog' (SCHED_FIFO 60) took the "));
}

// The kernel's limit cannot interrupt it.
TEST_F(Trial, FindsAThreadThatTakesTheProcessorInTheSetUpAndBlocksAllSignals) {
  if (!Thread::start("probe", {.fifo = 1}, [] {})) GTEST_SKIP() << "no right to SCHED_FIFO";
  start("bottling_line");
  EXPECT_THAT(refusal("manager_setup_deaf_hog"),
              HasSubstr("in the set-up, thread 'hog' (SCHED_FIFO 60) took the "));
}

TEST_F(Trial, FindsThatThePoolHasNoRoomForAnEvent) {
  auto pool = start_with_full_pool();
  ASSERT_TRUE(pool);
  EXPECT_THAT(refusal("packer"), AllOf(HasSubstr("has no room for event 'line1/product'"), HasSubstr("64")));
  EXPECT_EQ(plant_.ask(ControlVerb::load_application, "line1", Plant::application("manager_chatter")).code,
            ErrorCode::ok)
      << "it needs no more than the one that runs";
  pid_ = plant_.status("line1").pid;
  for (const int number : {0, 1}) ASSERT_TRUE(pool->remove_object(name_of(number)));
  ASSERT_TRUE(pool->create_semaphore("line1/product", 1, {.keep = true}));
  EXPECT_THAT(refusal("packer"), HasSubstr("'line1/product' in pool"));
  ASSERT_TRUE(pool->remove_object("line1/product"));
  const auto reply = plant_.ask(ControlVerb::load_application, "line1", Plant::application("packer"));
  EXPECT_EQ(reply.code, ErrorCode::ok) << reply.text;
}

TEST_F(Trial, FindsThatThePoolHasNoRoomForAMemory) {
  auto pool = start_with_full_pool();
  ASSERT_TRUE(pool);
  ASSERT_TRUE(pool->remove_object(name_of(0)));  // for its event
  EXPECT_THAT(refusal("areas"), AllOf(HasSubstr("has no room for memory 'line1.retain'"), HasSubstr("64")));
  ASSERT_TRUE(pool->remove_object(name_of(1)));
  plant_.write_file(
      "line1.cfg", "[SysMem]\nLinux.Area.0.Flags=0x8000\nLinux.Area.0.Object=io.data\nLinux.Area.0.Size=8\n");
  EXPECT_THAT(refusal("areas"), HasSubstr("has no room for memory '"));
  ASSERT_TRUE(pool->remove_object(name_of(2)));
  const auto reply = plant_.ask(ControlVerb::load_application, "line1", Plant::application("areas"));
  EXPECT_EQ(reply.code, ErrorCode::ok) << reply.text;
}

// It changes nothing that it looks at: a good program can be loaded, again and again.
TEST_F(Trial, LeavesNothingBehindAndTakesNothingAway) {
  start("areas");
  for (int i = 0; i < 2; ++i) {
    const auto reply = plant_.ask(ControlVerb::load_application, "line1", Plant::application("areas"));
    EXPECT_EQ(reply.code, ErrorCode::ok) << reply.text;
  }
  EXPECT_EQ(plant_.ask(ControlVerb::stop, "line1").code, ErrorCode::ok);
  EXPECT_EQ(plant_.stop_manager().describe(), "exit code 0");
  EXPECT_THAT(plant_.leftovers(), testing::IsEmpty());
}

}  // namespace
}  // namespace plchost
