#pragma once

#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "instances/adapters/run_program.hpp"
#include "shm/files/pool_files.hpp"
#include "shm/plc_process_image.h"
#include "tests/integration/instances/instance_process.hpp"

namespace plchost::testing {

struct ImageIn {
  std::uint8_t bits = 0, unused = 0;
  std::int16_t raw = 0;
};
struct ImageOut {
  std::uint8_t bits = 0, unused = 0;
  std::int16_t twice = 0;
  std::uint8_t edges = 0, copied = 0, loops = 0, preset = 0, posts = 0;
};

/// Outputs of two tasks, one of which the other one interrupts.
struct Interrupted {
  std::uint8_t bits = 0, unused[3]{};
  std::int32_t lost = 0, slow = 0, fast = 0;
};

/// Builds programs in Structured Text, and runs them.
class StructuredText : public ::testing::Test {
 protected:
  ~StructuredText() override { clear(); }

  /// Ends the instance, and forgets its areas.
  void clear() {
    end();
    remove_pool_memories(sandbox.pool());
  }
  /// `scheduler`: empty: that of the application, or the usual one.
  void start(const std::string& application, const std::string& kind = "first",
             const std::string& scheduler = "") {
    end();
    const std::string settings = sandbox.write(
        "line1.cfg", fmt::format("[SysMem]\nLinux.Area.0.Flags=0x4\nLinux.Area.0.Object=in\n"
                                 "Linux.Area.0.Size={0}\nLinux.Area.1.Flags=0x8\nLinux.Area.1.Object=out\n"
                                 "Linux.Area.1.Size={0}\n",
                                 image_bytes));
    std::vector<std::string> arguments{"--settings",        settings,
                                       "--application",     application,
                                       "--state-directory", sandbox.folder() + "/state",
                                       "--start-kind",      kind};
    if (!scheduler.empty()) arguments.insert(arguments.end(), {"--scheduler", scheduler});
    sut.emplace(sandbox, arguments);
    sut->wait_until_up();
    ASSERT_EQ(plc_image_open(sandbox.pool().c_str(), "in", image_bytes, PLC_IMAGE_WRITE, &inputs_), 0);
    ASSERT_EQ(plc_image_open(sandbox.pool().c_str(), "out", image_bytes, PLC_IMAGE_READ, &outputs_), 0);
  }
  template <class Image = ImageIn>
  void put(const Image& inputs) {
    std::vector<char> bytes(image_bytes);
    std::memcpy(bytes.data(), &inputs, sizeof inputs);
    plc_image_write(&inputs_, bytes.data());
  }
  template <class Image = ImageOut>
  Image outputs() {
    std::vector<char> bytes(image_bytes);
    EXPECT_EQ(plc_image_read(&outputs_, bytes.data(), nullptr), PLC_IMAGE_OK);
    Image outputs;
    std::memcpy(&outputs, bytes.data(), sizeof outputs);
    return outputs;
  }
  /// The program of structured_text_test.cpp, in whichever way it was made.
  void expect_it_works() {
    EXPECT_TRUE(eventually([&] { return outputs().preset == 9; })) << "initial values are put out";
    put({.raw = 21});
    EXPECT_TRUE(eventually([&] { return outputs().twice == 42; }));
    EXPECT_EQ(outputs().edges, 0);
    put({.bits = 1, .raw = -3});
    EXPECT_TRUE(eventually([&] {
      return outputs().twice == -6 && outputs().bits == 2 && outputs().copied == 2;
    })) << "the bit and the byte around it are one memory";
    EXPECT_TRUE(eventually([&] { return outputs().edges == 1; })) << "SINGLE";
    EXPECT_TRUE(eventually([&] { return outputs().loops == 1; })) << "a program without a task, by way of %M";
    put({.bits = 0, .raw = 0});
    EXPECT_TRUE(eventually([&] { return outputs().bits == 0 && outputs().loops == 0; }));
    put({.bits = 1, .raw = 0});
    EXPECT_TRUE(eventually([&] { return outputs().edges == 2; }));
    const auto fast = sut->task("fast");
    ASSERT_TRUE(fast);
    EXPECT_GT(fast->counters.cycles, 0U);
  }
  static bool has(const char* folder_of_compiler) {
    const char* const folder = std::getenv(folder_of_compiler);  // NOLINT(concurrency-mt-unsafe)
    return folder != nullptr && *folder != '\0';
  }
  ProgramEnd build(const std::string& text, const std::string& name = "twice",
                   const std::string& compiler = "matiec") const {
    return run_program({PLCCTL, "build", "application", sandbox.write(name + ".st", text), "-o", so(name),
                        "--compiler", compiler},
                       sandbox.folder())
        .value();
  }
  std::string so(const std::string& name) const { return sandbox.folder() + "/" + name + ".so"; }

  Sandbox sandbox;
  std::optional<InstanceProcess> sut;
  unsigned image_bytes = 64;

 private:
  void end() {
    plc_image_close(&inputs_);
    plc_image_close(&outputs_);
    sut.reset();
  }

  plc_image inputs_{};
  plc_image outputs_{};
};

/// By each of them.
class TranslatedText : public StructuredText, public ::testing::WithParamInterface<std::string> {
 protected:
  void SetUp() override {
    const bool is_matiec = GetParam() == "matiec";
    if (!has(is_matiec ? "PLCHOST_MATIEC" : "PLCHOST_STRUCPP")) GTEST_SKIP() << "needs " << GetParam();
  }
  ProgramEnd build(const std::string& text, const std::string& name = "twice") const {
    return StructuredText::build(text, name, GetParam());
  }
};

}  // namespace plchost::testing
