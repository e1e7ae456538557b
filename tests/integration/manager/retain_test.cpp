// The count of a packer, over the ends of its process, of its manager and of both.
#include <csignal>
#include <filesystem>
#include <optional>
#include <string>

#include <gmock/gmock.h>

#include "shm/plc_process_image.h"
#include "shm/pool/object_pool.hpp"
#include "tests/integration/manager/plant.hpp"

namespace plchost {
namespace {

using testing::ElementsAre;
using testing::EndsWith;
using testing::HasSubstr;
using testing::IsEmpty;

class RetainUnderAManager : public testing::Test {
 protected:
  RetainUnderAManager() {
    plant.add("packer1", "packer");
    plant.start_manager();
    up();
  }
  void up() { ASSERT_TRUE(plant.wait_for("packer1", InstanceState::running)) << plant.log(); }
  void post(int products) const {
    const auto pool = ObjectPool::attach(plant.pool()).value();
    auto event = pool.open_event("packer1/product").value();
    for (int i = 0; i < products; ++i) (void)event.post();
  }
  /// It says so of itself once a second, from now on.
  bool has_counted(const std::string& products) {
    const std::size_t before = plant.log().size();
    return Plant::eventually(
        [&] { return plant.log().find("products " + products + ", ", before) != std::string::npos; });
  }
  void kill_instance() {
    const auto process = open_process(plant.status("packer1").pid);
    ASSERT_TRUE(process);
    ASSERT_TRUE(signal_process(*process, SIGKILL));
  }

  Plant plant;
};

TEST_F(RetainUnderAManager, IsThereAfterItsProcessWasKilledAndAfterAWarmReset) {
  post(24);
  ASSERT_TRUE(has_counted("24"));
  kill_instance();
  ASSERT_TRUE(Plant::eventually([&] { return plant.status("packer1").restarts == 1; }));
  up();
  EXPECT_TRUE(has_counted("24"));
  EXPECT_EQ(plant.ask(ControlVerb::reset, "packer1").code, ErrorCode::ok);
  EXPECT_EQ(plant.ask(ControlVerb::start, "packer1").code, ErrorCode::ok);
  EXPECT_TRUE(has_counted("24"));
}

TEST_F(RetainUnderAManager, IsAnObjectOfThePoolAsIsAnImageThatFirmwareMadeWithAHeaderAlone) {
  plc_image image{};
  ASSERT_EQ(plc_image_open(plant.pool().c_str(), "terminal9.in", 64, PLC_IMAGE_WRITE, &image), 0);
  const auto pool = ObjectPool::attach(plant.pool(), MemoryFile::Access::read_only).value();
  EXPECT_TRUE(Plant::eventually([&] { return pool.look_at("terminal9.in").has_value(); }))
      << "the manager looks for it";
  EXPECT_EQ(pool.look_at("terminal9.in")->size, plc_image_bytes(64));
  const auto kept = pool.look_at("packer1.retain");
  ASSERT_TRUE(kept) << kept.error().describe();
  EXPECT_TRUE(kept->kept);
  EXPECT_EQ(kept->reference_count, 1U);
  plc_image_close(&image);
}

TEST_F(RetainUnderAManager, BeginsAnewAfterAColdReset) {
  post(24);
  ASSERT_TRUE(has_counted("24"));
  EXPECT_EQ(plant.ask(ControlVerb::reset_cold, "packer1").code, ErrorCode::ok);
  EXPECT_EQ(plant.ask(ControlVerb::start, "packer1").code, ErrorCode::ok);
  EXPECT_TRUE(has_counted("0"));
}

TEST_F(RetainUnderAManager, IsThereAfterManagerAndProcessWereKilled) {
  post(24);
  ASSERT_TRUE(has_counted("24"));
  plant.kill_manager();
  post(1);
  ASSERT_TRUE(plant.eventually([&] { return plant.cycles_of("packer1", "Product") >= 25; })) << "it runs on";
  const int pid = [&] {
    const auto page = InstancePageReader::open(plant.pool(), "packer1");
    return page && page->runtime() ? page->runtime()->pid : 0;
  }();
  const auto process = open_process(pid);
  ASSERT_TRUE(process);
  ASSERT_TRUE(signal_process(*process, SIGKILL));
  plant.start_manager();
  up();
  EXPECT_TRUE(has_counted("25"));
}

TEST_F(RetainUnderAManager, IsThereAfterAnOrderlyEndThatLeavesNoMemory) {
  post(24);
  ASSERT_TRUE(has_counted("24"));
  EXPECT_EQ(plant.stop_manager().describe(), "exit code 0");
  EXPECT_THAT(plant.leftovers(), IsEmpty());
  plant.start_manager();
  up();
  EXPECT_TRUE(has_counted("24"));
}

/// Its values are written once an hour, so values that are there after an orderly end were saved because of
/// the end.
class RetainThatIsSeldomWritten : public testing::Test {
 protected:
  void begin(const std::string& keys) {
    plant.write_file("packer.cfg",
                     "[CmpSchedule]\nTask.Freewheeling.Cycletime=10\n[Retain]\nIntervalMs=3600000\n");
    plant.add("packer1", "packer", "settings = \"packer.cfg\"\n" + keys);
    plant.start_manager();
    ASSERT_TRUE(plant.wait_for("packer1", InstanceState::running)) << plant.log();
    count_to_24();
  }
  void count_to_24() {
    const auto pool = ObjectPool::attach(plant.pool()).value();
    auto event = pool.open_event("packer1/product").value();
    for (int i = 0; i < 24; ++i) (void)event.post();
    ASSERT_TRUE(has_counted_24());
  }
  bool has_counted_24() {
    const std::size_t before = plant.log().size();
    return Plant::eventually([&] { return plant.log().find("products 24, ", before) != std::string::npos; });
  }
  void crash() {
    const auto process = open_process(plant.status("packer1").pid);
    ASSERT_TRUE(process);
    ASSERT_TRUE(signal_process(*process, SIGKILL));
  }
  /// The manager's helper writes the wish of the instance, and may wait for the disk. The answer to a command
  /// waits for the helper, and says so if that takes too long.
  bool wish_is_on_disk() {
    const ControlReply reply = plant.ask(ControlVerb::set_scheduler, "packer1", "CmpSchedule");
    EXPECT_EQ(reply.code, ErrorCode::ok) << reply.text;
    return !reply.text.contains("power cut");
  }
  /// An operator starts it, whatever the manager before had to say of it.
  void start_again() {
    plant.start_manager();
    EXPECT_EQ(plant.ask(ControlVerb::reset, "packer1").code, ErrorCode::ok);
    EXPECT_EQ(plant.ask(ControlVerb::start, "packer1").code, ErrorCode::ok);
    ASSERT_TRUE(plant.wait_for("packer1", InstanceState::running)) << plant.log();
  }
  void expect_24_after_an_orderly_end() {
    EXPECT_EQ(plant.stop_manager().describe(), "exit code 0");
    EXPECT_THAT(plant.leftovers(), IsEmpty()) << "values in a file need no memory";
    start_again();
    EXPECT_TRUE(has_counted_24()) << plant.log();
  }

  Plant plant;
};

TEST_F(RetainThatIsSeldomWritten, IsSavedAtTheEndOfTheHostIfItsInstanceHasFailed) {
  begin("restart = \"never\"");
  crash();
  ASSERT_TRUE(plant.wait_for("packer1", InstanceState::failed));
  expect_24_after_an_orderly_end();
}

TEST_F(RetainThatIsSeldomWritten, IsSavedAtTheEndOfTheHostIfItsInstanceIsInBackOff) {
  begin("restart = \"always\"\nrestart_delay_ms = 60000\nrestart_delay_max_ms = 60000");
  crash();
  ASSERT_TRUE(plant.wait_for("packer1", InstanceState::waiting));
  expect_24_after_an_orderly_end();
}

TEST_F(RetainThatIsSeldomWritten, IsSavedAtTheEndOfTheHostIfItsInstanceIsInSafeMode) {
  begin("crash_limit = 1");
  crash();
  ASSERT_TRUE(plant.wait_for("packer1", InstanceState::safe_mode));
  expect_24_after_an_orderly_end();
}

TEST_F(RetainThatIsSeldomWritten, StaysInMemoryAtTheEndOfTheHostIfNoFolderTakesIt) {
  begin("");
  ASSERT_TRUE(Plant::eventually([&] { return wish_is_on_disk(); }));
  std::filesystem::rename(plant.state_directory(), plant.state_directory() + ".away");
  plant.write_file("state", "no folder");
  EXPECT_EQ(plant.stop_manager().describe(), "exit code 0");
  EXPECT_THAT(plant.leftovers(), ElementsAre(EndsWith(".memory.packer1.retain")));
  EXPECT_THAT(plant.log(), HasSubstr("are in no file and stay in"));
  plant.start_manager();
  ASSERT_TRUE(plant.wait_for("packer1", InstanceState::running)) << "the machine runs; " << plant.log();
  EXPECT_TRUE(has_counted_24());
  const auto problem = [&] {
    const auto page = InstancePageReader::open(plant.pool(), "packer1");
    const auto runtime = page ? page->runtime() : std::nullopt;
    return runtime ? std::string(runtime->retain_problem.view()) : std::string();
  };
  EXPECT_TRUE(Plant::eventually([&] { return !problem().empty(); }));
  EXPECT_THAT(problem(), HasSubstr("retain variables are not written: "));
  // The disk is mended, and what happened meanwhile is in a file after the end.
  std::filesystem::remove(plant.state_directory());
  std::filesystem::rename(plant.state_directory() + ".away", plant.state_directory());
  EXPECT_EQ(plant.stop_manager().describe(), "exit code 0");
  EXPECT_THAT(plant.leftovers(), IsEmpty());
  plant.start_manager();
  ASSERT_TRUE(plant.wait_for("packer1", InstanceState::running)) << plant.log();
  EXPECT_TRUE(has_counted_24());
}

}  // namespace
}  // namespace plchost
