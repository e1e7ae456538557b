// Images under load: writers and readers in threads here; in processes in tests/integration/instances.
#include <algorithm>
#include <array>
#include <atomic>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <numeric>
#include <string>
#include <thread>

#include <gtest/gtest.h>
#include <sys/stat.h>

#include "instances/runtime/memory/output_image.hpp"
#include "instances/runtime/memory/silence.hpp"
#include "instances/runtime/memory/task_areas.hpp"
#include "shm/files/memory_file.hpp"
#include "shm/files/pool_files.hpp"
#include "shm/plc_process_image.h"
#include "tests/support/own_name.hpp"

namespace plchost {
namespace {

/// An image in memory of this process.
struct Memory {
  explicit Memory(std::uint32_t size) : words(plc_image_bytes(size) / 8 + 1) {
    plc_image_begin(reinterpret_cast<plc_image_header*>(words.data()), size);
  }
  [[nodiscard]] std::span<std::byte> bytes() { return std::as_writable_bytes(std::span(words)); }
  std::vector<std::uint64_t> words;
};

/// All of its words are the same in one image.
template <std::size_t Size>
bool is_whole(const std::array<std::uint64_t, Size>& words) {
  return std::adjacent_find(words.begin(), words.end(), std::not_equal_to<>()) == words.end();
}

TEST(ProcessImage, SaysThatNothingWasWrittenYet) {
  Memory memory(12);
  const plc_image sut = image_in(memory.bytes(), 12);
  std::array<char, 12> bytes{};
  EXPECT_EQ(plc_image_read(&sut, bytes.data(), nullptr), PLC_IMAGE_NONE);
}

TEST(ProcessImage, OfAnySizeIsReadAsItWasWritten) {
  for (std::uint32_t size = 1; size <= 80; ++size) {
    Memory memory(size);
    const plc_image sut = image_in(memory.bytes(), size);
    std::vector<unsigned char> written(size);
    std::iota(written.begin(), written.end(), static_cast<unsigned char>(1));
    plc_image_write(&sut, written.data());
    std::vector<unsigned char> read(size + 1, 0xee);
    plc_image_i64 stamp = 0;
    ASSERT_EQ(plc_image_read(&sut, read.data(), &stamp), PLC_IMAGE_OK);
    EXPECT_TRUE(std::equal(written.begin(), written.end(), read.begin())) << size;
    EXPECT_EQ(read[size], 0xee) << "nothing behind its end";
    EXPECT_GT(stamp, 0);
  }
}

constexpr std::size_t kWords = 512;
using Image = std::array<std::uint64_t, kWords>;

TEST(ProcessImage, IsNeverHalfOfOneForAReaderThatIsOvertaken) {
  Memory memory(sizeof(Image));
  const plc_image sut = image_in(memory.bytes(), sizeof(Image));
  std::atomic<bool> stop{false};
  std::thread writer([&] {
    Image image{};
    while (!stop) {
      image.fill(image[0] + 1);
      plc_image_write(&sut, image.data());
    }
  });
  Image image{};
  std::uint64_t before = 0;
  int read = 0;
  while (read < 20'000) {
    if (plc_image_read(&sut, image.data(), nullptr) != PLC_IMAGE_OK) continue;
    ++read;
    ASSERT_TRUE(is_whole(image));
    ASSERT_GE(image[0], before) << "never an older one";
    before = image[0];
  }
  stop = true;
  writer.join();
}

TEST(ProcessImage, OfAWriterThatDiedInTheMiddleIsTheOneBefore) {
  Memory memory(sizeof(Image));
  const plc_image sut = image_in(memory.bytes(), sizeof(Image));
  Image image{};
  image.fill(7);
  plc_image_write(&sut, image.data());
  // The work of a writer that was killed before it published.
  image.fill(8);
  plc_image_fill(&sut, 2, 2, image.data(), 0);
  plc_image_slot_at(&sut, 2)->sequence = 0;
  ASSERT_EQ(plc_image_read(&sut, image.data(), nullptr), PLC_IMAGE_OK);
  EXPECT_EQ(image[0], 7U);
  image.fill(9);
  plc_image_write(&sut, image.data());
  ASSERT_EQ(plc_image_read(&sut, image.data(), nullptr), PLC_IMAGE_OK);
  EXPECT_EQ(image[0], 9U);
}

TEST(ProcessImage, WithANumberOfAStrangerIsBusyAndThenWrittenAnew) {
  Memory memory(sizeof(Image));
  const plc_image sut = image_in(memory.bytes(), sizeof(Image));
  Image image{};
  for (const std::uint64_t latest : {~std::uint64_t{0}, std::uint64_t{0x1ff}, std::uint64_t{0x105}}) {
    sut.header->latest = latest;
    EXPECT_EQ(plc_image_read(&sut, image.data(), nullptr), PLC_IMAGE_BUSY);
    OutputImage outputs(memory.bytes(), sizeof(Image));
    std::vector<std::byte> scratch(sizeof(Image));
    EXPECT_TRUE(outputs.merge(scratch, [](std::span<std::byte> bytes) { bytes[0] = std::byte{1}; }));
    EXPECT_EQ(plc_image_read(&sut, image.data(), nullptr), PLC_IMAGE_OK);
  }
}

// As tasks of different priority, on however many cores: each counts in its own word, and none is lost.
TEST(OutputImage, OfManyTasksLosesNoneOfTheirBytes) {
  constexpr std::size_t kTasks = 6;
  constexpr std::uint64_t kCycles = 20'000;
  Memory memory(sizeof(Image));
  OutputImage sut(memory.bytes(), sizeof(Image));
  std::atomic<bool> stop{false};
  std::vector<std::thread> tasks;
  for (std::size_t task = 0; task < kTasks; ++task) {
    tasks.emplace_back([&, task] {
      const std::size_t at = task * 64;
      OutputView view(std::vector<std::byte>(sizeof(Image)),
                      {.own = {{.offset = at, .bytes = 64}}, .shared = {}, .sole = false}, &sut);
      // Without a pause between cycles one can be too late at each attempt: then its next cycle takes it
      // along.
      std::uint64_t missed = 0;
      for (std::uint64_t cycle = 1; cycle <= kCycles || view.missed() != missed; ++cycle) {
        missed = view.missed();
        const std::uint64_t value = std::min(cycle, kCycles);
        view.begin_cycle();
        for (std::size_t word = 0; word < 8; ++word) std::memcpy(view.bytes() + at + 8 * word, &value, 8);
        view.end_cycle();
      }
    });
  }
  std::thread reader([&] {
    Image image{};
    std::array<std::uint64_t, kTasks> before{};
    while (!stop) {
      if (plc_image_read(&sut.image(), image.data(), nullptr) != PLC_IMAGE_OK) continue;
      for (std::size_t task = 0; task < kTasks; ++task) {
        for (std::size_t word = 1; word < 8; ++word) {
          if (image[task * 8 + word] != image[task * 8])
            return ADD_FAILURE() << "half a cycle of task " << task;
        }
        if (image[task * 8] < before[task]) return ADD_FAILURE() << "task " << task << " went back";
        before[task] = image[task * 8];
      }
    }
  });
  for (std::thread& task : tasks) task.join();
  stop = true;
  reader.join();
  Image image{};
  ASSERT_EQ(plc_image_read(&sut.image(), image.data(), nullptr), PLC_IMAGE_OK);
  for (std::size_t task = 0; task < kTasks; ++task) EXPECT_EQ(image[task * 8], kCycles);
}

TEST(OutputImage, OfTasksWithoutBytesOfTheirOwnHasWhatEachHasChanged) {
  Memory memory(16);
  OutputImage sut(memory.bytes(), 16);
  const OutputView::Writes all{.own = {}, .shared = {{.offset = 0, .bytes = 16}}, .sole = false};
  OutputView high(std::vector<std::byte>(16), all, &sut);
  OutputView low(std::vector<std::byte>(16), all, &sut);
  low.begin_cycle();
  low.bytes()[1] = std::byte{0x11};
  // In the middle of the low one's cycle:
  high.begin_cycle();
  EXPECT_EQ(high.bytes()[1], std::byte{0}) << "half a cycle is nobody's to see";
  high.bytes()[2] = std::byte{0x22};
  high.end_cycle();
  EXPECT_EQ(low.bytes()[2], std::byte{0}) << "nothing changes in the middle of its cycle";
  low.end_cycle();
  std::array<std::byte, 16> image{};
  ASSERT_EQ(plc_image_read(&sut.image(), image.data(), nullptr), PLC_IMAGE_OK);
  EXPECT_EQ(image[1], std::byte{0x11});
  EXPECT_EQ(image[2], std::byte{0x22}) << "the low one has not put back what it saw before";
  high.begin_cycle();
  EXPECT_EQ(high.bytes()[1], std::byte{0x11});
}

/// An image that firmware writes with what is shown at its end.
struct WatchedImage : ::testing::Test {
  void write(std::uint64_t value, std::uint64_t at_end) const {
    plc_image_write_watched(&sut, &value, &at_end);
  }
  void be_silent(plc_image_i64 for_ns) const { sut.header->heartbeat_ns = plc_image_now_ns() - for_ns; }
  [[nodiscard]] std::uint64_t shown() const {
    std::uint64_t value = 0;
    EXPECT_EQ(plc_image_read(&sut, &value, nullptr), PLC_IMAGE_OK);
    return value;
  }
  static constexpr plc_image_i64 kTooLong = PLC_IMAGE_PATIENCE_NS + 1'000'000;
  Memory memory{8};
  const plc_image sut = image_in(memory.bytes(), 8);
};

TEST_F(WatchedImage, IsThatOfTheEndOnceItsWriterIsSilent) {
  write(1, 101);
  tell_silence(sut);
  EXPECT_EQ(shown(), 1U);
  be_silent(kTooLong);
  EXPECT_EQ(shown(), 1U) << "nobody has looked";
  tell_silence(sut);
  EXPECT_EQ(shown(), 101U);
  EXPECT_EQ(plc_image_state(&sut), PLC_IMAGE_STATE_SILENT);
  write(2, 102);
  EXPECT_EQ(shown(), 2U) << "it was only late";
  EXPECT_EQ(plc_image_state(&sut), PLC_IMAGE_STATE_RUNNING);
  be_silent(kTooLong);
  tell_silence(sut);
  EXPECT_EQ(shown(), 102U);
}

// A SIGSTOP of an instance is no end of its outputs, and firmware may write only what has changed.
TEST_F(WatchedImage, IsNoneOfAWriterThatDoesNotSaySo) {
  const std::uint64_t value = 1;
  plc_image_write(&sut, &value);
  be_silent(kTooLong);
  tell_silence(sut);
  EXPECT_EQ(plc_image_state(&sut), PLC_IMAGE_STATE_UNTOLD);
  plc_image_set_safe(&sut, &value);
  plc_image_tell(&sut, PLC_IMAGE_STATE_RUNNING, 0);
  for (const unsigned on_end : {0U, 1U}) {
    sut.header->on_end = on_end;
    tell_silence(sut);
    EXPECT_EQ(plc_image_state(&sut), PLC_IMAGE_STATE_RUNNING);
  }
}

TEST_F(WatchedImage, OfAnEndThatWasToldIsNotToldAnew) {
  write(1, 101);
  plc_image_tell(&sut, PLC_IMAGE_STATE_ENDED, 1);
  be_silent(kTooLong);
  tell_silence(sut);
  EXPECT_EQ(plc_image_state(&sut), PLC_IMAGE_STATE_ENDED);
  EXPECT_EQ(shown(), 101U);
}

TEST(InputView, KeepsTheImageThatItHadWhileTheWriterIsInTheWay) {
  Memory memory(8);
  const plc_image source = image_in(memory.bytes(), 8);
  InputView sut(std::vector<std::byte>(8, std::byte{5}), &source);
  sut.begin_cycle();
  EXPECT_EQ(sut.bytes()[0], std::byte{5}) << "initial values until something was written";
  EXPECT_EQ(sut.missed(), 0U);
  const std::uint64_t value = 0x0909090909090909;
  plc_image_write(&source, &value);
  sut.begin_cycle();
  EXPECT_EQ(sut.bytes()[7], std::byte{9});
  plc_image_slot_at(&source, 1)->sequence = 0;  // overwritten at just this moment
  sut.begin_cycle();
  EXPECT_EQ(sut.bytes()[7], std::byte{9});
  EXPECT_EQ(sut.missed(), 1U);
}

TEST(Registers, AreCopiedByteForByteWhereverTheyLie) {
  alignas(8) std::array<std::byte, 40> registers{};
  for (std::size_t i = 0; i < registers.size(); ++i) registers[i] = static_cast<std::byte>(i);
  for (std::size_t offset = 0; offset < 8; ++offset) {
    for (std::size_t bytes = 0; bytes <= 24; ++bytes) {
      std::vector<std::byte> read(bytes);
      const auto part = std::span(registers).subspan(offset, bytes);
      copy_from_registers(read, part);
      ASSERT_TRUE(std::equal(part.begin(), part.end(), read.begin()));
      auto written = registers;
      const std::vector<std::byte> ones(bytes, std::byte{0xff});
      copy_to_registers(std::span(written).subspan(offset, bytes), ones);
      for (std::size_t i = 0; i < written.size(); ++i) {
        const bool inside = i >= offset && i < offset + bytes;
        ASSERT_EQ(written[i], inside ? std::byte{0xff} : registers[i]);
      }
    }
  }
}

class OpenedImage : public ::testing::Test {
 protected:
  ~OpenedImage() override { MemoryFile::remove(pool_memory_name(pool, "io")); }
  const std::string pool = own_name("image");
};

TEST_F(OpenedImage, IsMadeByWhoeverComesFirstAndHasOneWriter) {
  plc_image reader;
  plc_image writer;
  plc_image second;
  ASSERT_EQ(plc_image_open(pool.c_str(), "io", 8, PLC_IMAGE_READ, &reader), 0);
  ASSERT_EQ(plc_image_open(pool.c_str(), "io", 8, PLC_IMAGE_WRITE, &writer), 0);
  EXPECT_EQ(plc_image_open(pool.c_str(), "io", 8, PLC_IMAGE_WRITE, &second), EBUSY);
  EXPECT_EQ(plc_image_open(pool.c_str(), "io", 16, PLC_IMAGE_READ, &second), EPROTO) << "another size";
  const std::uint64_t value = 42;
  plc_image_write(&writer, &value);
  std::uint64_t read = 0;
  EXPECT_EQ(plc_image_read(&reader, &read, nullptr), PLC_IMAGE_OK);
  EXPECT_EQ(read, 42U);
  plc_image_close(&writer);
  ASSERT_EQ(plc_image_open(pool.c_str(), "io", 8, PLC_IMAGE_WRITE, &writer), 0);
  EXPECT_EQ(plc_image_sequence(&writer), 1U) << "it outlives its writer";
  EXPECT_EQ(plc_image_gone(&reader, pool.c_str(), "io"), 0);
  MemoryFile::remove(pool_memory_name(pool, "io"));
  EXPECT_NE(plc_image_gone(&reader, pool.c_str(), "io"), 0);
  plc_image_close(&reader);
  plc_image_close(&writer);
}

// It is killed, and the next one comes before anybody has looked, or after that.
TEST_F(OpenedImage, OfAWriterThatEndedSuddenlyStaysThatOfItsEndUntilTheNextOneWrites) {
  plc_image reader;
  ASSERT_EQ(plc_image_open(pool.c_str(), "io", 8, PLC_IMAGE_READ, &reader), 0);
  const auto shown = [&] {
    std::uint64_t value = 0;
    EXPECT_EQ(plc_image_read(&reader, &value, nullptr), PLC_IMAGE_OK);
    return value;
  };
  for (const bool told : {false, true}) {
    plc_image writer;
    ASSERT_EQ(plc_image_open(pool.c_str(), "io", 8, PLC_IMAGE_WRITE, &writer), 0);
    const std::uint64_t good = 1;
    const std::uint64_t at_end = 101;
    plc_image_write_watched(&writer, &good, &at_end);
    plc_image_close(&writer);
    EXPECT_EQ(shown(), good);
    if (told) {
      reader.header->heartbeat_ns -= 2 * PLC_IMAGE_PATIENCE_NS;
      tell_silence(reader);
      EXPECT_EQ(shown(), at_end);
    }
    ASSERT_EQ(plc_image_open(pool.c_str(), "io", 8, PLC_IMAGE_WRITE, &writer), 0);
    EXPECT_EQ(shown(), at_end);
    EXPECT_EQ(plc_image_state(&reader), PLC_IMAGE_STATE_UNTOLD);
    plc_image_write(&writer, &good);
    EXPECT_EQ(shown(), good);
    plc_image_close(&writer);
  }
  plc_image_close(&reader);
}

// As of a maker that was told that there is no memory. With none, each access to it would be a SIGBUS.
TEST_F(OpenedImage, OfAFileThatWasLeftWithoutMemoryHasItBeforeItIsUsed) {
  const std::string path = "/dev/shm/" + pool + ".memory.left";
  std::ofstream(path).close();
  std::filesystem::resize_file(path, plc_image_bytes(64));
  plc_image sut{};
  ASSERT_EQ(plc_image_open(pool.c_str(), "left", 64, PLC_IMAGE_WRITE, &sut), 0);
  struct stat file{};
  ASSERT_EQ(::stat(path.c_str(), &file), 0);
  EXPECT_GE(static_cast<unsigned long>(file.st_blocks) * 512, plc_image_bytes(64));
  plc_image_close(&sut);
  std::filesystem::remove(path);
}

TEST_F(OpenedImage, OfABadNameOrSizeIsRefused) {
  plc_image image;
  EXPECT_EQ(plc_image_open("", "io", 8, PLC_IMAGE_READ, &image), EINVAL);
  EXPECT_EQ(plc_image_open(pool.c_str(), "io", 0, PLC_IMAGE_READ, &image), EINVAL);
  EXPECT_EQ(plc_image_open(pool.c_str(), "io", PLC_IMAGE_MAX_SIZE + 1, PLC_IMAGE_READ, &image), EINVAL);
  EXPECT_EQ(plc_image_open(pool.c_str(), std::string(300, 'x').c_str(), 8, PLC_IMAGE_READ, &image),
            ENAMETOOLONG);
}

}  // namespace
}  // namespace plchost
