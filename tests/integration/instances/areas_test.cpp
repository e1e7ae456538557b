// The memory areas of real instances, beside firmware in processes of its own, under kill -9.
#include <array>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include "shm/files/memory_file.hpp"
#include "shm/files/pool_files.hpp"
#include "shm/plc_process_image.h"
#include "tests/integration/instances/instance_process.hpp"

namespace plchost::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr std::size_t kWords = 256;
using Words = std::array<std::uint64_t, kWords>;
struct Outputs {
  Words fast;
  Words slow;
};

bool is_whole(const Words& words) {
  return std::ranges::all_of(words, [&](std::uint64_t word) { return word == words[0]; });
}

/// A process that runs `body` until it is killed. `body` returns only when something is wrong.
class Firmware {
 public:
  template <class Body>
  explicit Firmware(const Body& body) : pid_(::fork()) {
    if (pid_ != 0) return;
    body();
    ::_exit(1);
  }
  ~Firmware() { kill(); }
  Firmware(const Firmware&) = delete;
  Firmware& operator=(const Firmware&) = delete;

  /// false: it had ended before, because something was wrong.
  bool kill() {
    if (pid_ < 0) return true;
    ::kill(pid_, SIGKILL);
    int status = 0;
    ::waitpid(std::exchange(pid_, -1), &status, 0);
    return WIFSIGNALED(status);
  }

 private:
  pid_t pid_;
};

/// The application's report about itself.
struct Report {
  unsigned long torn = 0, input = 0, missed = 0, late = 0, begun = 0, persistent = 0, data = 0, saves = 0;
  unsigned long prepared = 0, at_start = 0;
  unsigned origin = 0;
};

class AreasOf : public ::testing::Test {
 protected:
  ~AreasOf() override {
    sut.reset();
    remove_pool_memories(sandbox.pool());
  }

  void start(const std::string& settings, std::vector<std::string> more = {}) {
    sut.reset();
    more.insert(more.end(), {"--settings", sandbox.write("line1.cfg", settings), "--application",
                             application("areas"), "--state-directory", state_directory()});
    sut.emplace(sandbox, more);
  }
  void start_well(const std::string& settings = {}, std::vector<std::string> more = {}) {
    start(settings, std::move(more));
    sut->wait_until_up();
  }
  [[nodiscard]] std::string state_directory() const { return sandbox.folder() + "/state"; }
  [[nodiscard]] Report report() { return report_of(*sut); }
  static Report report_of(InstanceProcess& instance) {
    const auto reports = [&] {
      const std::string log = instance.log();
      std::size_t count = 0;
      for (std::size_t at = log.find("torn "); at != std::string::npos; at = log.find("torn ", at + 1))
        ++count;
      return count;
    };
    const std::size_t before = reports();
    (void)instance.event("report").post();
    std::string line;
    EXPECT_TRUE(eventually([&] {
      line = reports() > before ? instance.last_line_from("torn ") : "";
      return !line.empty();
    })) << instance.log();
    Report said;
    const int values = std::sscanf(
        line.c_str(),
        "torn %lu input %lu missed %lu late %lu begun %lu persistent %lu data %lu origin %u saves %lu "
        "prepared %lu with %lu",
        &said.torn, &said.input, &said.missed, &said.late, &said.begun, &said.persistent, &said.data,
        &said.origin, &said.saves, &said.prepared, &said.at_start);
    EXPECT_EQ(values, 11) << line;
    return said;
  }
  void power_cut() {
    sut->end(SIGKILL);
    remove_pool_memories(sandbox.pool());
  }

  static constexpr const char* kTerminal =
      "[SysMem]\nLinux.Area.0.Flags=0x4\nLinux.Area.0.Object=io.in\nLinux.Area.0.Size=2048\n"
      "Linux.Area.1.Flags=0x8\nLinux.Area.1.Object=io.out\nLinux.Area.1.Size=4096\n";
  Sandbox sandbox;
  std::optional<InstanceProcess> sut;
};

TEST_F(AreasOf, AnInstanceAreWholeForAllWhoReadThemUnderKills) {
  start_well(kTerminal);
  const std::string pool = sandbox.pool();
  const auto write_inputs = [&] {
    plc_image image;
    if (plc_image_open(pool.c_str(), "io.in", sizeof(Words), PLC_IMAGE_WRITE, &image) != 0) return;
    Words words{};
    for (std::uint64_t n = plc_image_sequence(&image) + 1;; ++n) {
      words.fill(n);
      plc_image_write(&image, words.data());
    }
  };
  const auto read_outputs = [&] {
    plc_image image;
    if (plc_image_open(pool.c_str(), "io.out", sizeof(Outputs), PLC_IMAGE_READ, &image) != 0) return;
    Outputs outputs{};
    for (;;) {
      if (plc_image_read(&image, &outputs, nullptr) != PLC_IMAGE_OK) continue;
      if (!is_whole(outputs.fast) || !is_whole(outputs.slow)) return;
    }
  };
  std::uint64_t before = 0;
  for (int round = 0; round < 40; ++round) {
    Firmware writer(write_inputs);
    Firmware reader(read_outputs);
    const auto fast = sut->task("Fast")->counters.cycles;
    ASSERT_TRUE(eventually([&] { return sut->task("Fast")->counters.cycles > fast + 20; }));
    EXPECT_TRUE(reader.kill()) << "it saw half a cycle";
    EXPECT_TRUE(writer.kill()) << "it could not have the image";
    if (round % 10 == 9) {
      const std::uint64_t input = report().input;
      EXPECT_GT(input, before) << "the inputs of these writers have not come";
      before = input;
    }
  }
  const Report said = report();
  EXPECT_EQ(said.torn, 0U);
  EXPECT_EQ(said.late, 0U);
  std::printf("input image %lu, %lu cycles kept the one before\n", said.input, said.missed);
}

TEST_F(AreasOf, AnInstanceThatIsKilledInACycleAreWholeAndGoOn) {
  plc_image image;
  std::uint64_t before = 0;
  for (int round = 0; round < 5; ++round) {
    start_well(kTerminal);
    if (round == 0) {
      ASSERT_EQ(plc_image_open(sandbox.pool().c_str(), "io.out", sizeof(Outputs), PLC_IMAGE_READ, &image), 0);
    }
    Outputs outputs{};
    ASSERT_TRUE(eventually([&] { return plc_image_sequence(&image) > before + 50; }));
    sut->end(SIGKILL);
    before = plc_image_sequence(&image);
    plc_image_i64 stamp = 0;
    ASSERT_EQ(plc_image_read(&image, &outputs, &stamp), PLC_IMAGE_OK);
    EXPECT_TRUE(is_whole(outputs.fast));
    EXPECT_TRUE(is_whole(outputs.slow));
    EXPECT_EQ(plc_image_gone(&image, sandbox.pool().c_str(), "io.out"), 0)
        << "the next process goes on with it";
  }
  plc_image_close(&image);
}

// The example firmware and the example application, each killed and started again beside the other.
TEST_F(AreasOf, APackerAreThoseOfTheTerminalWhoeverComesFirst) {
  const auto terminal = [&] {
    return std::make_unique<Firmware>([&] {
      const std::string log = sandbox.folder() + "/terminal";
      if (std::freopen(log.c_str(), "w", stdout) == nullptr) return;
      ::execl(IO_TERMINAL, IO_TERMINAL, "--pool", sandbox.pool().c_str(), "--name", "terminal1", "--cycle",
              "1000", static_cast<char*>(nullptr));
    });
  };
  const auto shows = [&](const std::string& text) {
    return eventually([&] {
      std::ostringstream log;
      log << std::ifstream(sandbox.folder() + "/terminal").rdbuf();
      const std::string all = log.str();
      const std::size_t line = all.rfind("cycles ", all.size() - 1);
      return line != std::string::npos && all.find(text, line) != std::string::npos;
    });
  };
  auto firmware = terminal();
  const auto start_packer = [&] {
    sut.emplace(sandbox,
                std::vector<std::string>{"--settings", PACKER_SETTINGS, "--application",
                                         application("packer"), "--state-directory", state_directory()});
    sut->wait_until_up();
  };
  start_packer();
  for (int i = 0; i < 12 * 6 * 5; ++i) (void)sut->event("product").post();
  EXPECT_TRUE(shows("driven; channel out/in: 30/30 5/5 1/1"));
  EXPECT_TRUE(eventually([&] { return sut->log().find("panel 1") != std::string::npos; })) << "echoed";
  firmware.reset();
  firmware = terminal();
  EXPECT_TRUE(shows("driven; channel out/in: 30/30 5/5 1/1"));
  sut->end(SIGKILL);
  EXPECT_TRUE(shows("safe state; channel out/in: 0/0 0/0 0/0"));
  sut.reset();
  start_packer();
  EXPECT_TRUE(shows("driven; channel out/in: 30/30 5/5 1/1")) << "and its counts are kept";
}

TEST_F(AreasOf, OutputsOfTwoInstancesInOneObjectAreRefused) {
  start_well(kTerminal);
  InstanceProcess second(sandbox, {"--name", "line2", "--settings", sandbox.write("line2.cfg", kTerminal),
                                   "--application", application("areas")});
  EXPECT_EQ(second.end(), 3);
  EXPECT_THAT(second.log(),
              AllOf(HasSubstr("line2.cfg:5: [SysMem] Area.1"), HasSubstr("has a writer already")));
}

TEST_F(AreasOf, ObjectThatIsEmptiedUnderARunningInstanceStopsNoTask) {
  start_well(kTerminal);
  const std::string file =
      fmt::format("{}/{}", MemoryFile::kDirectory, pool_memory_name(sandbox.pool(), "io.in"));
  fs::resize_file(file, 0);
  const auto fast = sut->task("Fast")->counters.cycles;
  EXPECT_TRUE(eventually([&] { return sut->task("Fast")->counters.cycles > fast + 20; }));
  EXPECT_EQ(sut->end(SIGTERM), 0);
}

TEST_F(AreasOf, AFileLieAtTheirAddressInIt) {
  const std::string file = sandbox.write("device", std::string(8192, '\0'));
  start_well(
      fmt::format("[SysMem]\nLinux.Area.0.Flags=0x8000\nLinux.Area.0.Address=0x1010\n"
                  "Linux.Area.0.Size=8\nLinux.Area.0.Device={}\n",
                  file));
  const auto value = [&] {
    std::ifstream stream(file, std::ios::binary);
    stream.seekg(0x1010);
    std::uint64_t word = 0;
    stream.read(reinterpret_cast<char*>(&word), sizeof word);
    return word;
  };
  EXPECT_TRUE(eventually([&] { return value() > 120; }));
}

TEST_F(AreasOf, WhatCannotBePlacedIsRefusedWithItsLine) {
  const std::string file = sandbox.write("device", std::string(4096, '\0'));
  const auto log_with = [&](const std::string& settings) {
    start("[SysMem]\n" + settings);
    EXPECT_EQ(sut->end(), 3);
    return sut->log();
  };
  const std::string area =
      "Linux.Area.0.Flags=0x8000\nLinux.Area.0.Address=0x1000\nLinux.Area.0.Device=" + file + "\n";
  EXPECT_THAT(log_with(area + "Linux.Area.0.Size=8\n"),
              HasSubstr("line1.cfg:2: [SysMem] Area.0: 0x8 bytes at 0x1000 of " + file +
                        ": the file ends at 0x1000"));
  EXPECT_THAT(
      log_with("Linux.Area.0.Flags=0x8000\nLinux.Area.0.Object=o\nLinux.Area.0.Size=7\n"),
      HasSubstr("line1.cfg:2: [SysMem] Area.0: area 'data' of the application has 8 bytes, 7 of the 7"));
  EXPECT_THAT(log_with("Linux.Area.0.Flags=0x8000\nLinux.Area.0.Address=0\nLinux.Area.0.Device=/dev/none\n"
                       "Linux.Area.0.Size=8\n"),
              HasSubstr("line1.cfg:2: [SysMem] Area.0: 0x8 bytes at 0x0 of /dev/none: cannot be opened"));
}

TEST_F(AreasOf, RetainLoseNothingWithTheProcess) {
  start_well();
  std::uint64_t least = 100;
  std::uint64_t persistent = 100;  // counted at the end of the entry: each kill may cut one cycle before it
  for (int round = 0; round < 10; ++round) {
    ASSERT_TRUE(eventually([&] { return sut->task("Fast")->counters.cycles > 20; }));
    const auto cycles = sut->task("Fast")->counters.cycles;
    sut->end(SIGKILL);
    start_well("", {"--start-kind", "after-fault"});
    least += cycles;
    const Report said = report();
    EXPECT_GE(said.begun, least);
    persistent += cycles;
    EXPECT_GE(said.persistent, persistent);
    persistent = said.persistent;
    EXPECT_EQ(said.origin, 1U);
    least = said.begun;
    sut->end(SIGKILL);
    start_well();
  }
}

TEST_F(AreasOf, AnApplicationAreToldOnceBeforeItsTasksStart) {
  start_well();
  EXPECT_EQ(report().at_start, 100U) << "initial values";
  ASSERT_TRUE(eventually([&] { return sut->task("Fast")->counters.cycles > 20; }));
  ASSERT_EQ(sut->ask(ControlVerb::stop).code, ErrorCode::ok);
  ASSERT_EQ(sut->ask(ControlVerb::start).code, ErrorCode::ok);
  const Report before = report();
  EXPECT_EQ(before.prepared, 1U);
  EXPECT_EQ(before.at_start, 100U);
  sut->end(SIGKILL);
  start_well("", {"--start-kind", "after-fault"});
  const Report after = report();
  EXPECT_EQ(after.prepared, 1U);
  EXPECT_GE(after.at_start, before.begun);
}

TEST_F(AreasOf, RetainLoseAtMostAnIntervalWithThePower) {
  start_well("[Retain]\nIntervalMs=20\n");
  for (int round = 0; round < 5; ++round) {
    Report last = report();
    ASSERT_TRUE(eventually([&] { return report().saves >= 3; }));
    // The values of three intervals ago have been written since.
    const Report then = report();
    ASSERT_TRUE(eventually([&] { return report().saves >= then.saves + 2; }));
    power_cut();
    start_well("[Retain]\nIntervalMs=20\n");
    const Report said = report();
    EXPECT_GE(said.begun, then.begun);
    EXPECT_GE(said.persistent, then.persistent);
    EXPECT_EQ(said.origin, 2U);
    EXPECT_LT(said.data, said.persistent) << "an area that is not retain begins anew";
    EXPECT_GE(then.begun, last.begun);
  }
}

TEST_F(AreasOf, RetainHaveTheirLastValuesAfterAnOrderlyEnd) {
  start_well("[Retain]\nIntervalMs=3600000\n");
  ASSERT_TRUE(eventually([&] { return sut->task("Fast")->counters.cycles > 50; }));
  EXPECT_EQ(sut->ask(ControlVerb::stop).code, ErrorCode::ok);
  const auto cycles = sut->task("Fast")->counters.cycles;
  EXPECT_EQ(sut->end(SIGTERM), 0);
  remove_pool_memories(sandbox.pool());
  start("", {"--stopped"});
  sut->wait_until_up(false);
  EXPECT_EQ(sut->end(SIGTERM), 0);
  start_well();
  EXPECT_GE(report().begun, 100 + cycles);
}

TEST_F(AreasOf, ColdResetInitialisesRetainAndKeepsPersistent) {
  start_well();
  ASSERT_TRUE(eventually([&] { return sut->task("Fast")->counters.cycles > 500; }));
  const Report before = report();
  EXPECT_EQ(sut->end(SIGTERM), 0);
  start_well("", {"--start-kind", "cold"});
  const Report said = report();
  EXPECT_LE(said.begun, 101 + sut->task("Fast")->counters.cycles) << "with the initial value, and one begun";
  EXPECT_GT(said.persistent, before.persistent);
}

TEST_F(AreasOf, AnotherApplicationIsRefusedWithTheSetting) {
  start_well();
  EXPECT_EQ(sut->end(SIGTERM), 0);
  const std::string settings = sandbox.write("other.cfg", "[Retain]\nMismatch=Refuse\n");
  InstanceProcess other(sandbox, {"--settings", settings, "--application", application("areas_other"),
                                  "--state-directory", state_directory()});
  EXPECT_EQ(other.end(), 3);
  EXPECT_THAT(other.log(), HasSubstr("of another layout: area 'kept' has another layout"));
}

// Its areas are placed when it comes to its clock device, which is none for this scheduler.
TEST_F(AreasOf, AStartThatFailsLateLeaveTheMemoryAndTheRetainValuesOfBefore) {
  start_well();
  ASSERT_TRUE(eventually([&] { return sut->task("Fast")->counters.cycles > 50; }));
  const Report before = report();
  EXPECT_EQ(sut->end(SIGTERM), 0);
  constexpr const char* kDevice = "/dev/clock-of-a-test";
  const std::string settings =
      sandbox.write("late.cfg", std::string("[CmpSchedule]\nSchedulerInterval=1000\n[SysTimer]\n"
                                            "Linux.TimerSource=Auxiliary\nLinux.AuxiliaryDevice=") +
                                    kDevice +
                                    "\n[SysMem]\nLinux.Area.0.Flags=0x8000\nLinux.Area.0.Object=fresh\n"
                                    "Linux.Area.0.Size=8\n");
  InstanceProcess late(sandbox,
                       {"--settings", settings, "--application", application("areas_other"), "--scheduler",
                        "CmpScheduleOneShot", "--state-directory", state_directory()},
                       {"LD_PRELOAD=" + application("clock_device"), "ASAN_OPTIONS=verify_asan_link_order=0",
                        std::string("CLOCK_DEVICE_PATH=") + kDevice, "CLOCK_DEVICE_KIND=hpet",
                        "CLOCK_DEVICE_PERCENT=100", "CLOCK_DEVICE_STOP=" + sandbox.folder() + "/stop"});
  EXPECT_EQ(late.end(), 3) << late.log();
  EXPECT_THAT(late.log(), HasSubstr("ticks only periodically"));
  EXPECT_EQ(ObjectPool::attach(sandbox.pool())->look_at("fresh").error().code, ErrorCode::not_found);
  start_well();
  const Report said = report();
  EXPECT_EQ(said.origin, 1U) << "the memory of the process before";
  EXPECT_GE(said.begun, before.begun);
}

TEST_F(AreasOf, TwoProcessesDoNotShareRetainFiles) {
  start_well();
  InstanceProcess second(sandbox, {"--pool", sandbox.pool() + "-2", "--application", application("areas"),
                                   "--state-directory", state_directory(), "--run-directory", ""});
  EXPECT_NE(second.end(), 0);
  EXPECT_THAT(second.log(), HasSubstr("retain files have one instance"));
  ObjectPool::remove(sandbox.pool() + "-2");
  remove_pool_memories(sandbox.pool() + "-2");
}

/// A file system of its own in a file, mounted as long as this lives.
class LoopMount {
 public:
  LoopMount(std::string image, std::string folder) : folder_(std::move(folder)) {
    fs::create_directories(folder_);
    mounted_ = run(fmt::format("mount -o loop '{}' '{}' 2>/dev/null", image, folder_));
  }
  ~LoopMount() {
    if (mounted_) {
      EXPECT_TRUE(run(fmt::format("umount '{}'", folder_)));
    }
  }
  LoopMount(const LoopMount&) = delete;
  LoopMount& operator=(const LoopMount&) = delete;
  [[nodiscard]] bool mounted() const { return mounted_; }
  [[nodiscard]] const std::string& folder() const { return folder_; }

  // NOLINTNEXTLINE(cert-env33-c): a test's own command
  static bool run(const std::string& command) { return std::system(command.c_str()) == 0; }

 private:
  std::string folder_;
  bool mounted_ = false;
};

// The files on the disk at some moment are those that a loss of power leaves: the file system's own cache is
// not in the copy.
TEST_F(AreasOf, RetainOnADiskThatLosesItsPowerHaveWhatWasWrittenLast) {
  const std::string image = sandbox.folder() + "/disk";
  std::ofstream(image).close();
  fs::resize_file(image, 16U << 20U);
  if (!LoopMount::run("mkfs.ext4 -q -F '" + image + "' >/dev/null 2>&1"))
    GTEST_SKIP() << "there is no mkfs.ext4";
  std::optional<LoopMount> disk(std::in_place, image, sandbox.folder() + "/state");
  if (!disk->mounted()) GTEST_SKIP() << "this place allows no mounts";
  start_well("[Retain]\nIntervalMs=10\n");
  for (int round = 0; round < 8; ++round) {
    const Report then = report();
    ASSERT_TRUE(eventually([&] { return report().saves >= then.saves + 2; }));
    const std::string cut = fmt::format("{}/cut{}", sandbox.folder(), round);
    ::kill(sut->pid(), SIGSTOP);
    fs::copy_file(image, cut);
    ::kill(sut->pid(), SIGCONT);
    const Sandbox after_cut;
    const LoopMount other(cut, sandbox.folder() + "/after");
    ASSERT_TRUE(other.mounted()) << "its journal is played back";
    InstanceProcess next(after_cut,
                         {"--application", application("areas"), "--state-directory", other.folder()});
    next.wait_until_up();
    const Report said = report_of(next);
    EXPECT_EQ(said.origin, 2U) << next.log();
    EXPECT_GE(said.begun, then.begun);
    EXPECT_GE(said.persistent, then.persistent);
    next.end(SIGTERM);
    fs::remove(cut);
  }
  sut->end(SIGTERM);
}

}  // namespace
}  // namespace plchost::testing
