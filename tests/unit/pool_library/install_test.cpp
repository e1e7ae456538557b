#include <filesystem>
#include <fstream>
#include <string>

#include <gmock/gmock.h>

#include "tests/unit/pool_library/library_fixture.hpp"

namespace {

class InstalledLibrary : public LibraryFixture {
 protected:
  void SetUp() override {
    // A program without them cannot load a library that was built with sanitizers.
    if (std::string(SANITIZERS) != "") GTEST_SKIP() << "built with sanitizers";
    std::filesystem::create_directories(folder_);
    const Run installed = run({"cmake", "--install", BUILD, "--component", "plcpool", "--prefix", prefix_});
    ASSERT_EQ(installed.code, 0) << installed.text;
  }
  ~InstalledLibrary() override { std::filesystem::remove_all(folder_); }

  /// Feeds no parts: it runs, so it was built and found its library.
  void expect_feeder(const std::string& program) const {
    EXPECT_EQ(
        run({program, name_, "0"}, "LD_LIBRARY_PATH=$(dirname $(find " + prefix_ + " -name libplcpool.so))")
            .text,
        "fed 0 parts\n");
  }

  std::string folder_ = std::filesystem::temp_directory_path() / name_;
  std::string prefix_ = folder_ + "/usr";
};

TEST_F(InstalledLibrary, IsFoundByPkgConfig) {
  const std::string flags = "$(PKG_CONFIG_PATH=$(dirname $(find " + prefix_ +
                            " -name plcpool.pc)) pkg-config --cflags --libs plcpool)";
  const Run built =
      run({}, "gcc -std=c89 -pedantic -Wall -Wextra -Werror " EXAMPLES "/parts_feeder/feeder.c -o " +
                  folder_ + "/feeder " + flags);
  ASSERT_EQ(built.code, 0) << built.text;
  expect_feeder(folder_ + "/feeder");
}

TEST_F(InstalledLibrary, IsFoundByCMake) {
  std::ofstream(folder_ + "/CMakeLists.txt") << "cmake_minimum_required(VERSION 3.25)\nproject(firmware C)\n"
                                                "find_package(plcpool 0.1 REQUIRED)\n"
                                                "add_executable(feeder " EXAMPLES
                                                "/parts_feeder/feeder.c)\n"
                                                "target_link_libraries(feeder plchost::plcpool)\n";
  const Run configured =
      run({"cmake", "-S", folder_, "-B", folder_ + "/build", "-DCMAKE_PREFIX_PATH=" + prefix_});
  ASSERT_EQ(configured.code, 0) << configured.text;
  const Run built = run({"cmake", "--build", folder_ + "/build"});
  ASSERT_EQ(built.code, 0) << built.text;
  expect_feeder(folder_ + "/build/feeder");
}

}  // namespace
