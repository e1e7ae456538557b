#pragma once

#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/integration/storage/disk_checks.hpp"
#include "tests/integration/storage/disk_model.hpp"
#include "tests/integration/storage/recording.hpp"
#include "tests/support/own_name.hpp"

extern "C" void mark_recording(const char* text);

namespace plchost {

/// A folder in which each change is recorded until a model of the disk is asked for.
class RecordedFolder : public testing::Test {
 protected:
  RecordedFolder() {
    std::filesystem::create_directories(top_);
    ::setenv("RECORDING", (root_ / "recording").c_str(), 1);  // NOLINT(concurrency-mt-unsafe)
    ::setenv("RECORDED_FOLDER", top_.c_str(), 1);             // NOLINT(concurrency-mt-unsafe)
  }
  ~RecordedFolder() override {
    stop();
    std::filesystem::remove_all(root_);
  }

  [[nodiscard]] const std::string& top() const noexcept { return top_; }
  [[nodiscard]] std::string path(const std::string& name) const { return top_ + "/" + name; }
  /// "kept all": all files are on the disk as they are now. "kept TEXT": those whose paths have that text.
  static void mark(const std::string& text) { mark_recording(text.c_str()); }

  [[nodiscard]] Result<DiskModel> read_model() {
    stop();
    PLCHOST_TRY_ASSIGN(auto changes, read_recording(root_ / "recording"));
    return DiskModel::make(std::move(changes), top_);
  }
  const DiskModel& model() {
    if (!model_) {
      auto made = read_model();
      EXPECT_TRUE(made) << made.error().describe();
      model_ = made ? std::make_unique<DiskModel>(*std::move(made)) : std::make_unique<DiskModel>();
    }
    return *model_;
  }
  /// Of all states.
  std::vector<std::string> problems(FileSystem file_system) {
    DiskChecks checks(model(), top_, root_ / "cut");
    checks.look_at_all(file_system);
    states_ += checks.states();
    return checks.problems();
  }
  [[nodiscard]] std::size_t states() const noexcept { return states_; }
  /// The recording leads to what is there.
  void expect_real_folder() { EXPECT_EQ(unrecorded(model(), top_), std::vector<std::string>()); }

 private:
  static void stop() {
    ::unsetenv("RECORDING");        // NOLINT(concurrency-mt-unsafe)
    ::unsetenv("RECORDED_FOLDER");  // NOLINT(concurrency-mt-unsafe)
  }

  std::filesystem::path root_ = own_path("recorded");
  std::string top_ = root_ / "disk";
  std::unique_ptr<DiskModel> model_;
  std::size_t states_ = 0;
};

}  // namespace plchost
