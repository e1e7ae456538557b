// A cycle with inputs, outputs and retain variables around it.
#include <array>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "instances/runtime/memory/areas.hpp"
#include "instances/runtime/memory/retain_group.hpp"
#include "instances/runtime/settings/read_settings.hpp"
#include "shm/files/pool_files.hpp"
#include "tests/conformance/malloc_count.hpp"
#include "tests/support/own_name.hpp"
#include "tests/support/whole_cycle.hpp"

namespace plchost {
namespace {

TEST(NoAllocation, InCyclesWithAreasOfEachKind) {
  const std::string name = own_name("areas");
  auto pool = ObjectPool::create(name).value();
  {
    const auto settings = parse_settings(
        "[SysMem]\nLinux.Area.0.Flags=4\nLinux.Area.0.Size=128\nLinux.Area.0.Object=in\n"
        "Linux.Area.1.Flags=8\nLinux.Area.1.Size=128\nLinux.Area.1.Object=out\n",
        "f");
    Areas areas;
    std::vector<DeclaredArea> all;
    std::vector<TaskConfig> tasks(2);
    tasks[0].name = "High";
    tasks[1].name = "Low";
    for (TaskConfig& task : tasks) task.entry = [] {};
    for (const auto& [area, flags] : {std::pair{"in", PLC_AREA_INPUT}, std::pair{"out", PLC_AREA_OUTPUT},
                                      std::pair{"kept", PLC_AREA_RETAIN}}) {
      Plc_Area declared{};
      declared.dwSize = sizeof declared;
      declared.dwFlags = flags;
      declared.pszName = area;
      declared.dwBytes = 128;
      RTS_RESULT result = ERR_OK;
      ASSERT_NE(areas.declare(all, &declared, result), RTS_INVALID_HANDLE);
    }
    ASSERT_TRUE(complete_uses(all, std::array<std::string, 2>{"High", "Low"}));
    const auto placed = areas.place(
        {.pool = &pool, .instance = "line1", .application = "A", .settings = settings->areas, .retain = {}},
        all, tasks);
    ASSERT_TRUE(placed) << placed.error().describe();
    MallocCount::begin();
    for (int cycle = 0; cycle < 10'000; ++cycle) {
      for (const TaskConfig& task : tasks) run_whole_cycle(task);
    }
    EXPECT_EQ(MallocCount::end(), 0U);
  }
  ObjectPool::remove(name);
  remove_pool_memories(name);
}

TEST(NoAllocation, InCyclesWithForcesThatAreExchanged) {
  std::array<std::int16_t, 3> values{};
  std::array<char, 20> text{};
  std::vector<ForceList> lists(2);
  const std::array one{std::byte{1}, std::byte{0}};
  for (std::int16_t& value : values) lists[0].add(std::as_writable_bytes(std::span(&value, 1)).data(), one);
  const std::vector<std::byte> letters(text.size(), std::byte{'x'});
  lists[1].add(std::as_writable_bytes(std::span(text)).data(), letters);
  std::vector<ForceSlot> slots(1);
  std::vector<TaskConfig> tasks(1);
  tasks[0].name = "Main";
  tasks[0].entry = [&] { values = {2, 2, 2}; };
  Areas areas;
  ASSERT_TRUE(areas.place(
      {.instance = "line1", .application = "A", .settings = {}, .retain = {}, .forces = slots}, {}, tasks));
  MallocCount::begin();
  for (int cycle = 0; cycle < 10'000; ++cycle) {
    slots[0].list = cycle % 3 == 2 ? nullptr : &lists[static_cast<std::size_t>(cycle % 3)];
    run_whole_cycle(tasks[0]);
    ASSERT_EQ(values[2], cycle % 3 == 0 ? 1 : 2);
  }
  EXPECT_EQ(MallocCount::end(), 0U);
  EXPECT_EQ(text[19], 'x');
}

TEST(NoAllocation, WhenATaskGivesItsRetainAreasAtTheEndOfACycle) {
  CycleCounter counter{2};
  const std::vector<std::byte> live(4096, std::byte{1});
  std::vector<std::byte> copy(4096);
  RetainGroup sut({&counter}, {{.offset = 0, .live = live}});
  int given = 0;
  MallocCount::begin();
  for (int cycle = 0; cycle < 1000; ++cycle) {
    sut.ask(copy);
    sut.answer(false);
    if (sut.withdraw()) ++given;
  }
  EXPECT_EQ(MallocCount::end(), 0U);
  EXPECT_EQ(given, 1000);
  EXPECT_EQ(copy, live);
}

}  // namespace
}  // namespace plchost
