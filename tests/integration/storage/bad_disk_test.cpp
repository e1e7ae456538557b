// Audit log and exceptions on a disk that refuses what it had taken. The recorder is linked, and lets the
// disk do so.
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "api/audit/audit_check.hpp"
#include "api/audit/audit_log.hpp"
#include "manager/store/exception_folder.hpp"
#include "shm/pages/exception_history.hpp"
#include "tests/integration/storage/stop_record.hpp"
#include "tests/support/own_name.hpp"

namespace plchost {
namespace {

namespace fs = std::filesystem;
using testing::AnyOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

class OnABadDisk : public testing::Test {
 protected:
  OnABadDisk() {
    fs::create_directories(top_);
    ::setenv("RECORDED_FOLDER", top_.c_str(), 1);  // NOLINT(concurrency-mt-unsafe)
    ::setenv("DISK_FAULT", fault_.c_str(), 1);     // NOLINT(concurrency-mt-unsafe)
  }
  ~OnABadDisk() override {
    ::unsetenv("DISK_FAULT");       // NOLINT(concurrency-mt-unsafe)
    ::unsetenv("RECORDED_FOLDER");  // NOLINT(concurrency-mt-unsafe)
    fs::remove_all(root_);
  }

  const fs::path root_ = own_path("bad_disk");
  const fs::path fault_ = root_ / "fault";
  const fs::path top_ = root_ / "disk";
};

class LogOnABadDisk : public OnABadDisk {
 protected:
  [[nodiscard]] std::unique_ptr<AuditLog> open() const {
    auto log = AuditLog::open({.folder = folder_});
    EXPECT_TRUE(log) << log.error().describe();
    return log ? *std::move(log) : nullptr;
  }
  /// A log whose first sync fails, with a record of its own or without. The process before has left one.
  [[nodiscard]] std::unique_ptr<AuditLog> open_with_a_fault(bool with_record) const {
    std::unique_ptr<AuditLog> log = open();
    EXPECT_TRUE(log->append(stop_of("line1")));
    do {  // it may have been synced just before
      fs::remove(fault_);
      log.reset();
      log = open();
      EXPECT_TRUE(!with_record || log->append(stop_of("line2")));
      std::ofstream(fault_) << "read-only";
    } while (!tells_of_a_problem(*log));
    return log;
  }
  static bool tells_of_a_problem(const AuditLog& log) {
    for (int looks = 0; looks < 30 && log.sync_problem().empty(); ++looks)
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    return !log.sync_problem().empty();
  }
  void mend(const AuditLog& log) const {
    fs::remove(fault_);
    while (!log.sync_problem().empty()) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  [[nodiscard]] std::vector<std::string> remarks() const {
    const auto checked = check_audit(folder_);
    EXPECT_TRUE(checked);
    EXPECT_THAT(checked->problems, IsEmpty());
    return checked->remarks;
  }

  const std::string folder_ = top_ / "audit.cell";
};

// The bytes of the process before, whose end the disk may have refused: nobody has them any more.
TEST_F(LogOnABadDisk, TellsThatRecordsOfTheProcessBeforeMayBeMissing) {
  {
    const auto log = open_with_a_fault(false);
    mend(*log);
    ASSERT_TRUE(log->append(stop_of("line3")));
  }
  EXPECT_THAT(remarks(), ElementsAre(HasSubstr("or may be missing")));
}

TEST_F(LogOnABadDisk, TellsOnceOfThoseOfTheProcessBeforeAndEachTimeOfItsOwn) {
  {
    const auto log = open_with_a_fault(true);
    mend(*log);
    ASSERT_TRUE(log->append(stop_of("line3")));
    do {
      fs::remove(fault_);
      ASSERT_TRUE(log->append(stop_of("line4")));
      std::ofstream(fault_) << "read-only";
    } while (!tells_of_a_problem(*log));
    mend(*log);
    ASSERT_TRUE(log->append(stop_of("line5")));
  }
  EXPECT_THAT(remarks(),
              ElementsAre(HasSubstr("or may be missing"), HasSubstr("records before were written again"),
                          HasSubstr("records before were written again")));
}

TEST_F(LogOnABadDisk, WritesNothingIntoAnotherFileOfItsName) {
  const fs::path file = folder_ + "/audit.0000000001.log";
  const fs::path other = root_ / "other";
  const auto log = open_with_a_fault(true);
  std::ofstream(other) << "of another program";
  // Not rename(), which the disk refuses.
  ASSERT_EQ(::syscall(SYS_renameat2, AT_FDCWD, other.c_str(), AT_FDCWD, file.c_str(), 0U), 0);
  mend(*log);
  std::ifstream stream(file);
  EXPECT_EQ((std::string{std::istreambuf_iterator<char>(stream), {}}), "of another program");
}

TEST_F(OnABadDisk, ExceptionsAreRefusedWithTheDisksErrorAndKeptWhenItIsWell) {
  const std::string written = root_ / "line1.exception";  // of the run directory
  const std::string file = kept_exceptions_path(exceptions_folder(top_.string(), "cell"), "line1");
  const auto raise = [&](const char* task) {
    ExceptionEntry entry;
    entry.unix_ns = 1;
    entry.task = task;
    ASSERT_TRUE(keep_exceptions(written, std::span(&entry, 1)));
  };
  raise("First");
  ASSERT_TRUE(keep_exceptions_on_disk(file, written));
  raise("Second");
  for (const char* const fault : {"full", "read-only"}) {
    std::ofstream(fault_) << fault;
    const auto refused = keep_exceptions_on_disk(file, written);
    ASSERT_FALSE(refused) << fault;
    EXPECT_THAT(refused.error().describe(),
                AnyOf(HasSubstr("No space left on device"), HasSubstr("Read-only file system")));
    EXPECT_EQ(read_exceptions(file)->entries.size(), 1U);
    fs::remove(fault_);
  }
  ASSERT_TRUE(keep_exceptions_on_disk(file, written));
  EXPECT_EQ(read_exceptions(file)->entries.back().task, "Second");
}

TEST_F(OnABadDisk, ExceptionsOfTheDiskReplaceNoneThatTheInstanceHasWritten) {
  const std::string written = root_ / "line1.exception";  // of the run directory
  const std::string file = kept_exceptions_path(exceptions_folder(top_.string(), "cell"), "line1");
  ExceptionEntry entry;
  entry.unix_ns = 1;
  entry.task = "Fill";
  ASSERT_TRUE(keep_exceptions(written, std::span(&entry, 1)));
  ASSERT_TRUE(keep_exceptions_on_disk(file, written));
  fs::remove(written);
  const auto restored = restore_exceptions(file, written);
  ASSERT_TRUE(restored) << restored.error().describe();
  EXPECT_EQ(read_exceptions(written).value(), read_exceptions(file).value());
  fs::remove(written);
  entry.task = "Label";
  ASSERT_TRUE(keep_exceptions(written, std::span(&entry, 1)));
  EXPECT_TRUE(restore_exceptions(file, written));
  EXPECT_EQ(read_exceptions(written)->entries.back().task, "Label");
  for (const auto& left : fs::directory_iterator(root_)) EXPECT_NE(left.path().extension(), ".kept");
}

TEST_F(OnABadDisk, ExceptionsWithoutATimeAreNotKeptOnTheDisk) {
  const std::string written = root_ / "line1.exception";
  const std::string file = kept_exceptions_path(exceptions_folder(top_.string(), "cell"), "line1");
  ExceptionHistory history;
  history.add({});
  ASSERT_TRUE(write_exceptions(written, history));
  for (int i = 0; i < 2; ++i) EXPECT_TRUE(keep_exceptions_on_disk(file, written));
  EXPECT_FALSE(fs::exists(file));
}

// Those of instances that the configuration does not have any more stay as long as there is room.
TEST_F(OnABadDisk, ExceptionsOfTheInstancesThatWereWrittenLastStay) {
  const std::string written = root_ / "line1.exception";
  const std::string folder = exceptions_folder(top_.string(), "cell");
  ExceptionEntry entry;
  entry.unix_ns = 1;
  entry.task = "Fill";
  ASSERT_TRUE(keep_exceptions(written, std::span(&entry, 1)));
  for (std::size_t i = 0; i <= kMostExceptionFiles; ++i) {
    const std::string file = kept_exceptions_path(folder, "line" + std::to_string(i));
    ASSERT_TRUE(keep_exceptions_on_disk(file, written));
    if (i == 0) fs::last_write_time(file, fs::file_time_type::clock::now() - std::chrono::hours(1));
  }
  EXPECT_EQ(std::distance(fs::directory_iterator(folder), {}),
            static_cast<std::ptrdiff_t>(kMostExceptionFiles));
  EXPECT_FALSE(fs::exists(kept_exceptions_path(folder, "line0")));
  EXPECT_TRUE(fs::exists(kept_exceptions_path(folder, "line1")));
}

}  // namespace
}  // namespace plchost
