#pragma once

#include <array>
#include <atomic>
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <sys/wait.h>

#include "shm/plc_pool.h"
#include "tests/support/own_name.hpp"

/// A pool of its own, through the C library alone; its files are gone at the end.
class LibraryFixture : public testing::Test {
 protected:
  struct Run {
    int code = -1;
    std::string text;  // both streams
  };

  LibraryFixture() : name_(plchost::own_name("library")) {
    EXPECT_EQ(plc_pool_open(name_.c_str(), PLC_POOL_MAKE, &pool_), PLC_POOL_OK) << plc_pool_error();
  }
  ~LibraryFixture() override {
    plc_pool_close(pool_);
    for (const auto& file : std::filesystem::directory_iterator("/dev/shm")) {
      if (file.path().filename().string().starts_with(name_)) std::filesystem::remove(file.path());
    }
  }

  static Run run(const std::vector<std::string>& words, const std::string& before = "") {
    std::string line = before;
    for (const std::string& word : words) line += " '" + word + "'";
    Run run;
    FILE* const pipe = ::popen((line + " 2>&1").c_str(), "r");
    std::array<char, 256> part{};
    while (std::fgets(part.data(), part.size(), pipe) != nullptr) run.text += part.data();
    const int status = ::pclose(pipe);
    run.code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    return run;
  }
  [[nodiscard]] Run walk(const std::string& object) const {
    return run({PROGRAMS "/walk", object}, "PLCHOST_POOL=" + name_);
  }

  std::string name_;
  plc_pool* pool_ = nullptr;
};
