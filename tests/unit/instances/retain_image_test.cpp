// The files of retain variables: one that is cut, changed or torn is never taken for values.
#include "instances/runtime/memory/retain_image.hpp"

#include <csignal>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "instances/runtime/memory/retain_files.hpp"
#include "tests/support/own_name.hpp"

namespace plchost {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

RetainImage image(std::uint64_t generation) {
  return {.generation = generation,
          .unix_ns = 1,
          .layout = {.application = "Mixer",
                     .areas = {{.name = "recipe", .flags = 0x20, .bytes = 5, .layout = 7, .offset = 0},
                               {.name = "hours", .flags = 0x100, .bytes = 8, .layout = 0, .offset = 8}},
                     .bytes = 16},
          .data = std::vector<std::byte>(16, static_cast<std::byte>(generation))};
}

TEST(RetainImage, IsDecodedAsItWasEncoded) {
  const auto sut = decode_retain(encode(image(3)));
  ASSERT_TRUE(sut) << sut.error().message;
  EXPECT_EQ(*sut, image(3));
}

TEST(RetainImage, HasTheChecksumThatOthersCompute) {
  const std::string_view digits = "123456789";
  EXPECT_EQ(crc64(std::as_bytes(std::span(digits))), 0x995dc9bbdf1939faU);
}

TEST(RetainImage, CutAtAnyByteIsNone) {
  const std::string whole = encode(image(1));
  for (std::size_t size = 0; size < whole.size(); ++size) {
    ASSERT_FALSE(decode_retain(std::string_view(whole).substr(0, size))) << size;
  }
  EXPECT_FALSE(decode_retain(whole + '\0'));
}

TEST(RetainImage, WithAnyBitTurnedIsNone) {
  std::string file = encode(image(1));
  for (char& byte : file) {
    for (int bit = 0; bit < 8; ++bit) {
      byte = static_cast<char>(byte ^ (1 << bit));
      ASSERT_FALSE(decode_retain(file));
      byte = static_cast<char>(byte ^ (1 << bit));
    }
  }
  EXPECT_TRUE(decode_retain(file));
}

// A forger of a file makes its checksum, too.
TEST(RetainImage, WithARightChecksumAndWrongContentsIsNone) {
  const auto with = [](auto spoil) {
    RetainImage bad = image(1);
    spoil(bad);
    return decode_retain(encode(bad));
  };
  EXPECT_FALSE(with([](RetainImage& bad) { bad.layout.areas[1].offset = 0; })) << "over another";
  EXPECT_FALSE(with([](RetainImage& bad) { bad.layout.areas[1].offset = 9; })) << "unaligned";
  EXPECT_FALSE(with([](RetainImage& bad) { bad.layout.areas[1].bytes = 9; })) << "beyond the end";
  EXPECT_FALSE(with([](RetainImage& bad) { bad.layout.areas[1].offset = ~std::uint64_t{7}; }));
  EXPECT_FALSE(with([](RetainImage& bad) { bad.layout.bytes = 17; }));
  EXPECT_FALSE(with([](RetainImage& bad) { bad.layout.bytes = ~std::uint64_t{0}; }));
  EXPECT_FALSE(with([](RetainImage& bad) {
    bad.layout.areas.assign(kMaxRetainAreas + 1,
                            {.name = "", .flags = 0, .bytes = 0, .layout = 0, .offset = 0});
  }));
}

class RetainFolder : public ::testing::Test {
 protected:
  RetainFolder() { fs::remove_all(folder_); }
  ~RetainFolder() override { fs::remove_all(folder_); }

  [[nodiscard]] RetainFiles open() const { return RetainFiles::open(folder_, "line1").value(); }
  [[nodiscard]] std::string file(int number) const {
    return folder_ / ("line1.retain." + std::to_string(number));
  }
  static std::string read(const std::string& path) {
    std::ifstream stream(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
  }
  static void write(const std::string& path, std::string_view text) {
    std::ofstream(path, std::ios::binary | std::ios::trunc) << text;
  }

  fs::path folder_ = fs::path("/dev/shm") / own_name("retain");
};

TEST_F(RetainFolder, ThatIsNewHasNothingAndNoProblem) {
  const auto found = open().read();
  EXPECT_FALSE(found.newest);
  EXPECT_THAT(found.problems, IsEmpty());
}

TEST_F(RetainFolder, GivesTheNewestOfTwoGenerations) {
  RetainFiles sut = open();
  for (std::uint64_t generation = 1; generation <= 5; ++generation) {
    ASSERT_TRUE(sut.write(image(generation)));
    EXPECT_EQ(sut.read().newest, image(generation));
  }
  EXPECT_TRUE(decode_retain(read(file(0))));
  EXPECT_TRUE(decode_retain(read(file(1))));
}

TEST_F(RetainFolder, WithTheNewestCutAtAnyByteGivesTheOlderOne) {
  RetainFiles sut = open();
  ASSERT_TRUE(sut.write(image(1)));
  ASSERT_TRUE(sut.write(image(2)));
  const std::string whole = read(file(0));
  for (std::size_t size = 0; size < whole.size(); ++size) {
    write(file(0), std::string_view(whole).substr(0, size));
    const auto found = sut.read();
    ASSERT_EQ(found.newest, image(1)) << size;
    ASSERT_THAT(found.problems, SizeIs(1));
  }
}

TEST_F(RetainFolder, WithAnyBitOfTheNewestTurnedGivesTheOlderOne) {
  RetainFiles sut = open();
  ASSERT_TRUE(sut.write(image(1)));
  ASSERT_TRUE(sut.write(image(2)));
  std::string bytes = read(file(0));
  for (std::size_t bit = 0; bit < bytes.size() * 8; ++bit) {
    bytes[bit / 8] = static_cast<char>(bytes[bit / 8] ^ (1 << (bit % 8)));
    write(file(0), bytes);
    ASSERT_EQ(sut.read().newest, image(1)) << bit;
    bytes[bit / 8] = static_cast<char>(bytes[bit / 8] ^ (1 << (bit % 8)));
  }
}

TEST_F(RetainFolder, WithBothSpoiledGivesNone) {
  RetainFiles sut = open();
  ASSERT_TRUE(sut.write(image(1)));
  ASSERT_TRUE(sut.write(image(2)));
  write(file(0), "x");
  fs::resize_file(file(1), 40);
  const auto found = sut.read();
  EXPECT_FALSE(found.newest);
  EXPECT_THAT(found.problems, SizeIs(2));
}

// The states that a power cut may leave of a write. They are nothing of it, any part of the new file under
// its first name, all of it there, or the new name.
TEST_F(RetainFolder, LeftInTheMiddleOfAWriteGivesOneOfTheLastTwo) {
  RetainFiles sut = open();
  ASSERT_TRUE(sut.write(image(1)));
  ASSERT_TRUE(sut.write(image(2)));
  const std::string next = encode(image(3));
  for (std::size_t size = 0; size <= next.size(); ++size) {
    write(file(1) + ".new", std::string_view(next).substr(0, size));
    ASSERT_EQ(sut.read().newest, image(2)) << size;
  }
  fs::rename(file(1) + ".new", file(1));
  EXPECT_EQ(sut.read().newest, image(3));
  ASSERT_TRUE(sut.write(image(4)));
  EXPECT_EQ(sut.read().newest, image(4));
}

TEST_F(RetainFolder, IsOneProcesssAtATime) {
  const RetainFiles sut = open();
  const auto in_another_process = [&](const std::string& instance) {
    const pid_t child = ::fork();
    if (child == 0) {
      const auto files = RetainFiles::open(folder_, instance);
      ::_exit(files ? 0 : static_cast<int>(files.error().code));
    }
    int status = 0;
    ::waitpid(child, &status, 0);
    return static_cast<ErrorCode>(WEXITSTATUS(status));
  };
  EXPECT_EQ(in_another_process("line1"), ErrorCode::busy);
  EXPECT_EQ(in_another_process("line2"), ErrorCode::ok);
}

TEST_F(RetainFolder, ThatCannotBeMadeSaysWhyAtEachWrite) {
  auto sut = RetainFiles::open("/proc/none/here", "line1").value();
  EXPECT_FALSE(sut.read().newest);
  EXPECT_THAT(sut.write(image(1)).error().describe(), HasSubstr("/proc/none/here"));
}

TEST_F(RetainFolder, ThatOthersCanWriteGivesAndTakesNothing) {
  RetainFiles sut = open();
  ASSERT_TRUE(sut.write(image(1)));
  fs::permissions(folder_, fs::perms::all);
  const auto found = sut.read();
  EXPECT_FALSE(found.newest);
  EXPECT_THAT(found.problems, ElementsAre(HasSubstr("other users can put files into it")));
  auto later = RetainFiles::open(folder_, "line2").value();
  EXPECT_EQ(later.write(image(1)).error().code, ErrorCode::refused);
  fs::permissions(folder_, fs::perms::owner_all);
  EXPECT_EQ(sut.read().newest, image(1));
  EXPECT_TRUE(later.write(image(1)));
}

TEST_F(RetainFolder, ThatIsFullKeepsWhatItHasAndNoHalfFile) {
  RetainFiles sut = open();
  ASSERT_TRUE(sut.write(image(1)));
  ASSERT_TRUE(sut.write(image(2)));
  const auto refused = [&] {
    // A limit of the process stands for a full disk.
    const auto before = std::signal(SIGXFSZ, SIG_IGN);
    rlimit limit{};
    ::getrlimit(RLIMIT_FSIZE, &limit);
    const rlimit small{.rlim_cur = 16, .rlim_max = limit.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &small);
    auto written = sut.write(image(3));
    ::setrlimit(RLIMIT_FSIZE, &limit);
    (void)std::signal(SIGXFSZ, before);
    return written;
  }();
  ASSERT_FALSE(refused);
  EXPECT_FALSE(fs::exists(file(1) + ".new"));
  EXPECT_EQ(sut.read().newest, image(2));
  ASSERT_TRUE(sut.write(image(3)));
  EXPECT_EQ(sut.read().newest, image(3));
}

TEST_F(RetainFolder, WithAFileOfAnotherSizeThanAnyOfOursIsNotRead) {
  RetainFiles sut = open();
  write(file(0), "");
  fs::resize_file(file(0), std::uintmax_t{1} << 40U);
  const auto found = sut.read();
  EXPECT_FALSE(found.newest);
  EXPECT_THAT(found.problems, SizeIs(1));
}

}  // namespace
}  // namespace plchost
