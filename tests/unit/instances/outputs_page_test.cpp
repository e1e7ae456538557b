// The page in which a killed process leaves its outputs, and the process that makes them safe.
#include "shm/pages/outputs_page.hpp"

#include <array>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "shm/base/names.hpp"
#include "shm/files/memory_file.hpp"
#include "shm/plc_process_image.h"
#include "tests/support/own_name.hpp"

namespace plchost {
namespace {

class OutputsPageOf : public ::testing::Test {
 protected:
  OutputsPageOf() {
    std::ofstream(device, std::ios::binary) << std::string(64, 'x');
    EXPECT_EQ(plc_image_open(pool.c_str(), "io", 4, PLC_IMAGE_WRITE, &image), 0);
    plc_image_set_safe(&image, "SAFE");
    plc_image_write(&image, "live");
    image.header->on_end = 1;
  }
  ~OutputsPageOf() override {
    plc_image_close(&image);
    std::filesystem::remove(device);
    std::filesystem::remove(page());
    std::filesystem::remove("/dev/shm/" + pool + ".memory.io");
  }
  [[nodiscard]] std::string page() const { return MemoryFile::path(outputs_page_name(pool, "line1")); }
  [[nodiscard]] std::vector<LeftOutputs> outputs() const {
    const std::string values = "zero";
    std::vector<std::byte> bytes(4);
    std::memcpy(bytes.data(), values.data(), 4);
    return {{.object = "io", .device = {}, .values = {}},
            {.object = {}, .device = device, .address = 8, .values = bytes}};
  }
  // A process makes the page, and ends without a word.
  void leave() {
    const pid_t child = ::fork();
    if (child == 0) {
      image.header->writer = static_cast<plc_image_u64>(::getpid());
      const auto made = OutputsPage::create(pool, "line1", outputs());
      ::_exit(made ? 0 : 1);
    }
    int status = 0;
    ::waitpid(child, &status, 0);
    ASSERT_EQ(status, 0);
  }
  [[nodiscard]] std::string shown() const {
    std::array<char, 5> bytes{};
    EXPECT_EQ(plc_image_read(&image, bytes.data(), nullptr), PLC_IMAGE_OK);
    return bytes.data();
  }
  [[nodiscard]] std::string in_device() const {
    std::ifstream stream(device, std::ios::binary);
    std::string text(16, ' ');
    stream.read(text.data(), 16);
    return text;
  }

  std::string pool = own_name("outputs");
  std::string device = "/tmp/" + own_name("device");
  plc_image image{};
};

TEST_F(OutputsPageOf, AProcessThatHasEndedMakesThemSafeOnce) {
  leave();
  struct stat status{};
  ASSERT_EQ(::stat(page().c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777U, 0600U) << "another process opens what it names";
  end_outputs(pool, "line1");
  EXPECT_EQ(shown(), "SAFE");
  EXPECT_EQ(plc_image_state(&image), PLC_IMAGE_STATE_ENDED);
  EXPECT_EQ(in_device(), "xxxxxxxxzeroxxxx");
  EXPECT_FALSE(std::filesystem::exists(page()));
  plc_image_tell(&image, PLC_IMAGE_STATE_STOPPED, 1);
  end_outputs(pool, "line1");
  EXPECT_EQ(plc_image_state(&image), PLC_IMAGE_STATE_STOPPED) << "there is nothing left to do";
}

TEST_F(OutputsPageOf, AProcessThatRunsIsNotTouched) {
  const auto made = OutputsPage::create(pool, "line1", outputs());
  ASSERT_TRUE(made);
  image.header->writer = static_cast<plc_image_u64>(::getpid());
  end_outputs(pool, "line1");
  EXPECT_EQ(shown(), "live");
  EXPECT_EQ(in_device(), std::string(16, 'x'));
  EXPECT_TRUE(std::filesystem::exists(page()));
}

TEST_F(OutputsPageOf, AnImageThatAnotherProcessWritesByNowIsNotTouched) {
  leave();
  image.header->writer = 1;
  end_outputs(pool, "line1");
  EXPECT_EQ(shown(), "live");
}

TEST_F(OutputsPageOf, AStrangersBytesAreLeftAlone) {
  leave();
  const auto size = std::filesystem::file_size(page());
  for (std::size_t at = 0; at < 64; at += 4) {
    leave();
    std::fstream(page(), std::ios::binary | std::ios::in | std::ios::out)
        .seekp(static_cast<std::streamoff>(at))
        .write("\xff\xff\xff\x7f", 4);
    end_outputs(pool, "line1");
  }
  for (const std::uintmax_t cut : {std::uintmax_t{0}, std::uintmax_t{7}, std::uintmax_t{100}, size - 1}) {
    leave();
    std::filesystem::resize_file(page(), cut);
    plc_image_tell(&image, PLC_IMAGE_STATE_RUNNING, 0);
    end_outputs(pool, "line1");
    EXPECT_EQ(plc_image_state(&image), PLC_IMAGE_STATE_RUNNING) << cut;
  }
}

TEST_F(OutputsPageOf, AnImageOfAnotherVersionOrADeviceThatHasGoneLeavesTheOthers) {
  leave();
  image.header->version = 1;
  end_outputs(pool, "line1");
  EXPECT_EQ(in_device(), "xxxxxxxxzeroxxxx");
  image.header->version = PLC_IMAGE_VERSION;
  leave();
  std::filesystem::resize_file(device, 9);
  end_outputs(pool, "line1");
  EXPECT_EQ(plc_image_state(&image), PLC_IMAGE_STATE_ENDED);
}

TEST_F(OutputsPageOf, HasABound) {
  const std::vector<LeftOutputs> most(OutputsPage::kMost, {.object = "io", .device = {}, .values = {}});
  EXPECT_TRUE(OutputsPage::create(pool, "line1", most));
  std::vector<LeftOutputs> more = most;
  more.push_back(most.front());
  EXPECT_FALSE(OutputsPage::create(pool, "line1", more));
}

// Its beginning is the name of another file.
TEST_F(OutputsPageOf, RefusesADeviceWhosePathItCannotHold) {
  std::vector<LeftOutputs> left = outputs();
  left.back().device = "/" + std::string(kMaxPath - 1, 'd');
  EXPECT_TRUE(OutputsPage::create(pool, "line1", left));
  left.back().device += "d";
  const auto refused = OutputsPage::create(pool, "line1", left);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("has 256 bytes, 255 are allowed"), std::string::npos);
}

}  // namespace
}  // namespace plchost
