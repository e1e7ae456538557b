#pragma once

#include <cstring>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "instances/launch/launch_contract.hpp"
#include "instances/plc_app.h"
#include "instances/runtime/memory/retain_keeper.hpp"
#include "shm/files/memory_file.hpp"
#include "shm/files/pool_files.hpp"
#include "shm/pool/object_pool.hpp"
#include "tests/support/own_name.hpp"
#include "tests/unit/pool/unique_pool_name.hpp"

namespace plchost {

inline constexpr std::uint64_t kInitial = 1;

/// A keeper in a pool and a folder of its own.
class Retain : public ::testing::Test {
 protected:
  Retain() { std::filesystem::remove_all(folder_); }
  ~Retain() override {
    sut.reset();
    forget_memory();
    std::filesystem::remove_all(folder_);
  }

  /// One retain and one persistent variable of 8 bytes.
  static RetainImage initial(std::uint64_t layout = 0) {
    RetainImage image{
        .layout =
            {.application = "Mixer",
             .areas = {{.name = "count", .flags = PLC_AREA_RETAIN, .bytes = 8, .layout = layout, .offset = 0},
                       {.name = "hours", .flags = PLC_AREA_PERSISTENT, .bytes = 8, .layout = 0, .offset = 8}},
             .bytes = 16},
        .data = std::vector<std::byte>(16)};
    std::memcpy(image.data.data(), &kInitial, 8);
    std::memcpy(image.data.data() + 8, &kInitial, 8);
    return image;
  }
  [[nodiscard]] Result<void> start(const RetainImage& image, RetainKeeper::Options options = {}) {
    sut.reset();
    if (options.directory.empty()) options.directory = folder_;
    PLCHOST_TRY_ASSIGN(sut, RetainKeeper::make(pool_, "line1", image, options));
    return sut->start();
  }
  void start_well(RetainKeeper::Options options = {}) {
    const auto started = start(initial(), options);
    ASSERT_TRUE(started) << started.error().describe();
  }
  [[nodiscard]] std::uint64_t value(std::size_t area) const {
    std::uint64_t value = 0;
    std::memcpy(&value, sut->memory().data().data() + 8 * area, 8);
    return value;
  }
  void set(std::size_t area, std::uint64_t value) const {
    std::memcpy(sut->memory().data().data() + 8 * area, &value, 8);
  }
  /// As a power cut does.
  void forget_memory() const {
    MemoryFile::remove(pool_memory_name(name_.get(), retain_memory_name("line1")));
  }
  /// As a kill does: nothing is written at the end. The lock of the files goes with the process.
  void lose_files_of_the_end() {
    const std::filesystem::path aside = folder_.string() + ".aside";
    std::filesystem::copy(folder_, aside);
    sut.reset();
    std::filesystem::remove_all(folder_);
    std::filesystem::rename(aside, folder_);
  }

  std::filesystem::path folder_ = own_path("keeper");
  UniquePoolName name_;
  ObjectPool pool_ = ObjectPool::create(name_.get(), {.max_objects = 16}).value();
  std::unique_ptr<RetainKeeper> sut;
};

}  // namespace plchost
