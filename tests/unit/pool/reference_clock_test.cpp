#include "shm/pages/reference_clock.hpp"

#include <atomic>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <random>
#include <thread>

#include <gmock/gmock.h>

#include "shm/files/pool_files.hpp"
#include "tests/unit/pool/unique_pool_name.hpp"

namespace plchost {
namespace {

class ReferenceClockFile : public testing::Test {
 protected:
  ~ReferenceClockFile() override { ReferenceClockRecord::remove(pool(), "bus"); }
  [[nodiscard]] const std::string& pool() const { return name_.get(); }
  [[nodiscard]] ReferenceClockRecord open() const {
    auto opened = ReferenceClockRecord::open(pool(), "bus");
    EXPECT_TRUE(opened) << opened.error().describe();
    return std::move(opened).value();
  }
  [[nodiscard]] MemoryFile raw() const {
    return std::move(
        MemoryFile::open(pool_memory_name(pool(), "bus"), 1, MemoryFile::Access::read_write).value());
  }
  static int read(const ReferenceClockRecord& sut, plc_reference_reading& reading) {
    return plc_reference_clock_read(&sut.record(), &reading);
  }
  UniquePoolName name_;
};

TEST_F(ReferenceClockFile, FirmwareAndInstanceMeetInOneRecordWhoeverComesFirst) {
  plc_reference_clock* firmware = nullptr;
  ASSERT_EQ(plc_reference_clock_open(pool().c_str(), "bus", &firmware), 0);
  const auto sut = open();
  plc_reference_reading reading{};
  EXPECT_EQ(read(sut, reading), PLC_REFERENCE_NONE);
  plc_reference_clock_write(firmware, 17, 4, 1);
  ASSERT_EQ(read(sut, reading), PLC_REFERENCE_OK);
  EXPECT_EQ(reading.reference_ns, 17);
  EXPECT_EQ(reading.local_ns, 4);
  EXPECT_EQ(reading.updates, 1U);
  EXPECT_EQ(reading.valid, 1);
  plc_reference_clock_close(firmware);

  ReferenceClockRecord::remove(pool(), "bus");
  EXPECT_TRUE(sut.gone());
  const auto first = open();
  EXPECT_FALSE(first.gone());
  ASSERT_EQ(plc_reference_clock_open(pool().c_str(), "bus", &firmware), 0);
  plc_reference_clock_write(firmware, -5, 6, 0);
  ASSERT_EQ(read(first, reading), PLC_REFERENCE_OK);
  EXPECT_EQ(reading.reference_ns, -5);
  EXPECT_EQ(reading.valid, 0);
  plc_reference_clock_close(firmware);
}

TEST_F(ReferenceClockFile, RecordMadeAnewByOthersIsNoticed) {
  const auto sut = open();
  EXPECT_FALSE(sut.gone());
  ReferenceClockRecord::remove(pool(), "bus");
  const auto other = open();
  EXPECT_TRUE(sut.gone());
  EXPECT_FALSE(other.gone());
}

TEST_F(ReferenceClockFile, EmptyFileIsBegunAnewAndOneCutShortIsNoticed) {
  const std::string path = "/dev/shm/" + pool_memory_name(pool(), "bus");
  std::ofstream{path};
  const auto sut = open();
  EXPECT_EQ(std::filesystem::file_size(path), sizeof(plc_reference_clock));
  EXPECT_FALSE(sut.gone());
  std::filesystem::resize_file(path, sizeof(plc_reference_clock) - 1);
  EXPECT_TRUE(sut.gone());
}

TEST_F(ReferenceClockFile, RecordThatWasOverwrittenIsNoticed) {
  const auto sut = open();
  sut.record().magic ^= 1U;
  EXPECT_TRUE(sut.gone());
  EXPECT_FALSE(ReferenceClockRecord::open(pool(), "bus"));
}

TEST_F(ReferenceClockFile, WriterThatDiedWithinIsNotTakenAndTheNextWriteMendsIt) {
  const auto sut = open();
  plc_reference_clock_write(&sut.record(), 100, 200, 1);
  sut.record().sequence += 1;
  sut.record().reference_ns = 5;
  plc_reference_reading reading{};
  EXPECT_EQ(read(sut, reading), PLC_REFERENCE_BUSY);
  plc_reference_clock_write(&sut.record(), 300, 400, 1);
  ASSERT_EQ(read(sut, reading), PLC_REFERENCE_OK);
  EXPECT_EQ(reading.reference_ns, 300);
  EXPECT_EQ(sut.record().sequence % 2, 0U);
}

TEST_F(ReferenceClockFile, WhatNobodyHasWrittenIsCorrupt) {
  const auto sut = open();
  plc_reference_clock_write(&sut.record(), 100, 200, 1);
  const plc_reference_clock good = sut.record();
  plc_reference_reading reading{};
  for (std::size_t byte = offsetof(plc_reference_clock, reference_ns); byte < sizeof good; ++byte) {
    reinterpret_cast<unsigned char*>(&sut.record())[byte] ^= 0x10;
    EXPECT_EQ(read(sut, reading), PLC_REFERENCE_CORRUPT) << "byte " << byte;
    sut.record() = good;
  }
  EXPECT_EQ(read(sut, reading), PLC_REFERENCE_OK);
}

TEST_F(ReferenceClockFile, ReaderNeverSeesHalfOfAPair) {
  const auto sut = open();
  std::atomic<bool> go{true};
  std::thread writer([&] {
    for (plc_clock_i64 i = 1; go; ++i) plc_reference_clock_write(&sut.record(), i * 1'000'003, i, 1);
  });
  plc_reference_reading reading{};
  int good = 0;
  while (good < 20'000) {
    const int outcome = read(sut, reading);
    ASSERT_NE(outcome, PLC_REFERENCE_CORRUPT);
    if (outcome != PLC_REFERENCE_OK) continue;
    ASSERT_EQ(reading.reference_ns, reading.local_ns * 1'000'003);
    ++good;
  }
  go = false;
  writer.join();
}

TEST_F(ReferenceClockFile, OtherMemoryOfTheNameIsRefused) {
  const std::string file = pool_memory_name(pool(), "bus");
  for (const std::size_t size : {std::size_t{63}, std::size_t{65}, std::size_t{4096}}) {
    ASSERT_TRUE(MemoryFile::replace(file, size));
    const auto sut = ReferenceClockRecord::open(pool(), "bus");
    ASSERT_FALSE(sut);
    EXPECT_EQ(sut.error().code, ErrorCode::corrupt);
    plc_reference_clock* firmware = nullptr;
    EXPECT_EQ(plc_reference_clock_open(pool().c_str(), "bus", &firmware), EPROTO);
  }
  ReferenceClockRecord::remove(pool(), "bus");
  (void)open();
  reinterpret_cast<plc_reference_clock*>(raw().bytes().data())->version = 2;
  const auto sut = ReferenceClockRecord::open(pool(), "bus");
  ASSERT_FALSE(sut);
  EXPECT_THAT(sut.error().message, testing::HasSubstr("is no reference record of version 1"));
}

TEST_F(ReferenceClockFile, AllMemoriesOfAPoolGoAtOnceAndNoOthers) {
  const std::string other = pool() + "x";
  (void)open();
  ASSERT_TRUE(ReferenceClockRecord::open(pool(), "second"));
  ASSERT_TRUE(ReferenceClockRecord::open(other, "bus"));
  remove_pool_memories(pool());
  EXPECT_FALSE(MemoryFile::open(pool_memory_name(pool(), "bus"), 1, MemoryFile::Access::read_only));
  EXPECT_FALSE(MemoryFile::open(pool_memory_name(pool(), "second"), 1, MemoryFile::Access::read_only));
  EXPECT_TRUE(MemoryFile::open(pool_memory_name(other, "bus"), 1, MemoryFile::Access::read_only));
  ReferenceClockRecord::remove(other, "bus");
}

TEST_F(ReferenceClockFile, NamesThatLeadElsewhereAreRefused) {
  for (const char* name : {"", "a/b", "../x", ".hidden"}) {
    EXPECT_FALSE(ReferenceClockRecord::open(pool(), name)) << name;
  }
  EXPECT_FALSE(ReferenceClockRecord::open(pool(), std::string(96, 'a')));
}

}  // namespace
}  // namespace plchost
