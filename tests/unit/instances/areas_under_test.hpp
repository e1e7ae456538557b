#pragma once

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "instances/runtime/memory/areas.hpp"
#include "instances/runtime/settings/read_settings.hpp"
#include "shm/files/pool_files.hpp"
#include "shm/pages/outputs_page.hpp"
#include "tests/support/own_name.hpp"

namespace plchost {

class AreasUnderTest : public ::testing::Test {
 protected:
  ~AreasUnderTest() override {
    ObjectPool::remove(pool_);
    remove_pool_memories(pool_);
    OutputsPage::remove(pool_, "line1");
  }

  RTS_HANDLE declare(const char* name, unsigned flags, unsigned bytes, std::vector<Plc_Area_Use> uses = {},
                     void** address = nullptr, const void* initial = nullptr) {
    Plc_Area area{};
    area.dwSize = sizeof area;
    area.dwFlags = flags;
    area.pszName = name;
    area.dwBytes = bytes;
    area.nUses = static_cast<unsigned>(uses.size());
    area.pUses = uses.data();
    area.pInitial = initial;
    area.ppAddress = address;
    return sut.declare(declared, &area, result);
  }
  void task(const std::string& name, std::function<void()> entry) {
    TaskConfig config;
    config.name = name;
    config.entry = std::move(entry);
    tasks.push_back(std::move(config));
  }
  [[nodiscard]] Result<std::string> place(const std::string& settings = {}) {
    auto placed = place_only(settings);
    if (!placed) return placed;
    PLCHOST_TRY(sut.keep());
    sut.outputs().arm();
    return placed;
  }
  /// As a start does of which a later step may fail.
  [[nodiscard]] Result<std::string> place_only(const std::string& settings = {}) {
    settings_ = parse_settings(settings, "l.cfg").value();
    std::vector<std::string> names;
    for (const TaskConfig& task : tasks) names.push_back(task.name);
    PLCHOST_TRY(complete_uses(declared, names));
    const Areas::Environment environment{.pool = &shared_,
                                         .instance = "line1",
                                         .application = "Test",
                                         .settings = settings_.areas,
                                         .retain = retain_};
    PLCHOST_TRY(Areas::check(environment, declared));
    return sut.place(environment, declared, tasks);
  }

  std::string pool_ = own_name("areas");
  ObjectPool shared_ = ObjectPool::create(pool_).value();
  InstanceSettings settings_;
  RetainKeeper::Options retain_;
  Areas sut;
  std::vector<DeclaredArea> declared;
  std::vector<TaskConfig> tasks;
  RTS_RESULT result = ERR_OK;
};

}  // namespace plchost
