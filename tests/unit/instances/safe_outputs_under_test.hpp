#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "shm/plc_process_image.h"
#include "tests/support/own_name.hpp"
#include "tests/support/whole_cycle.hpp"
#include "tests/unit/instances/areas_under_test.hpp"

namespace plchost {

using Words = std::array<std::uint32_t, 3>;

inline std::string area_with(const std::string& safe, const std::string& size = "12") {
  return "[SysMem]\nLinux.Area.0.Flags=8\nLinux.Area.0.Object=io\nLinux.Area.0.Size=" + size +
         (safe.empty() ? "\n" : "\nLinux.Area.0.SafeState=" + safe + "\n");
}

/// An area of three words: one of each of two tasks, and one of neither.
class SafeOutputsOfAreas : public AreasUnderTest {
 protected:
  ~SafeOutputsOfAreas() override { close(); }

  void set_up(const std::string& safe, unsigned initial = 5) {
    task("One", [this] {
      words(one)[0] = value;
      words(one)[2] = value + 2;
    });
    task("Two", [this] { words(two)[1] = value + 1; });
    const Words initials{initial, initial, initial};
    declare("out", PLC_AREA_OUTPUT, 12, {{"One", 0, 4, &one}, {"Two", 4, 4, &two}}, nullptr, initials.data());
    const auto placed = place_only(area_with(safe));
    ASSERT_TRUE(placed) << placed.error().describe();
    ASSERT_TRUE(sut.keep());
    close();
    ASSERT_EQ(plc_image_open(pool_.c_str(), "io", 12, PLC_IMAGE_READ, &terminal.emplace()), 0);
  }
  void close() {
    if (terminal) plc_image_close(&*terminal);
    terminal.reset();
  }
  static std::uint32_t* words(void* area) { return static_cast<std::uint32_t*>(area); }
  void run(std::size_t task, unsigned with) {
    value = with;
    run_whole_cycle(tasks[task]);
  }
  /// A debugger halts these tasks, and no others.
  void halt(const std::vector<std::size_t>& halted) {
    sut.outputs().halt([&](std::size_t task) { return std::ranges::find(halted, task) != halted.end(); });
  }
  [[nodiscard]] Words shown() const {
    Words read{};
    EXPECT_EQ(plc_image_read(&*terminal, read.data(), nullptr), PLC_IMAGE_OK);
    return read;
  }
  [[nodiscard]] unsigned state() const { return plc_image_state(&*terminal); }

  std::optional<plc_image> terminal;
  void* one = nullptr;
  void* two = nullptr;
  unsigned value = 0;
};

/// The same in registers, which a file plays.
class SafeRegisters : public SafeOutputsOfAreas {
 protected:
  ~SafeRegisters() override { std::remove(file_.c_str()); }
  /// `safe`: empty: the settings name none.
  void place_registers(const std::string& safe, unsigned initial = 0) {
    std::ofstream(file_, std::ios::binary) << std::string(64, '\x07');
    task("One", [this] {
      words(one)[0] = value;
      if (changes) words(one)[2] = value + 2;
    });
    task("Two", [this] { words(two)[1] = value + 1; });
    const Words initials{initial, initial, initial};
    declare("out", PLC_AREA_OUTPUT, 12, {{"One", 0, 4, &one}, {"Two", 4, 4, &two}}, nullptr, initials.data());
    const auto placed = place_only(
        fmt::format("[SysMem]\nLinux.Area.0.Flags=8\nLinux.Area.0.Address=8\nLinux.Area.0.Device={}\n"
                    "Linux.Area.0.Size=12\n{}",
                    file_, safe.empty() ? "" : "Linux.Area.0.SafeState=" + safe + "\n"));
    ASSERT_TRUE(placed) << placed.error().describe();
    ASSERT_TRUE(sut.keep());
  }
  [[nodiscard]] Words in_file() const {
    std::ifstream stream(file_, std::ios::binary);
    stream.seekg(8);
    Words read{};
    stream.read(reinterpret_cast<char*>(read.data()), sizeof read);
    return read;
  }
  std::string file_ = "/tmp/" + own_name("registers");
  bool changes = true;
};

}  // namespace plchost
