// The writers of the files of a host, each cut at every change that it makes.
#include <algorithm>
#include <bitset>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "api/audit/audit_check.hpp"
#include "api/audit/audit_log.hpp"
#include "api/control/application_versions.hpp"
#include "api/security/sha256.hpp"
#include "instances/runtime/memory/retain_files.hpp"
#include "manager/store/exception_folder.hpp"
#include "manager/store/store_application.hpp"
#include "manager/store/wish_folder.hpp"
#include "shm/files/replace_file.hpp"
#include "shm/pages/exception_history.hpp"
#include "tests/integration/storage/recorded_folder.hpp"
#include "tests/integration/storage/stop_record.hpp"

namespace plchost {
namespace {

namespace fs = std::filesystem;
using testing::IsEmpty;

class WritersUnderPowerCuts : public RecordedFolder {
 protected:
  void expect_no_problem() {
    expect_real_folder();
    EXPECT_THAT(problems(FileSystem::ordered), IsEmpty());
    EXPECT_THAT(problems(FileSystem::weak), IsEmpty());
    fmt::print("{} states of the disk after a power cut\n", states());
  }
};

RetainImage values(std::uint64_t generation, std::uint32_t bytes) {
  return {.generation = generation,
          .unix_ns = 1,
          .layout = {.application = "Mixer",
                     .areas = {{.name = "recipe", .flags = 0x20, .bytes = bytes, .layout = 7, .offset = 0}},
                     .bytes = bytes},
          .data = std::vector<std::byte>(bytes, static_cast<std::byte>(generation))};
}

TEST_F(WritersUnderPowerCuts, KeepTheValuesOfRetainVariables) {
  constexpr std::uint32_t kBytes = 10'000;
  {
    auto files = RetainFiles::open(path("state"), "line1");
    ASSERT_TRUE(files) << files.error().describe();
    for (std::uint64_t generation = 1; generation <= 5; ++generation) {
      ASSERT_TRUE(files->write(values(generation, kBytes)));
      mark("kept .retain.");
    }
  }
  expect_no_problem();
}

TEST_F(WritersUnderPowerCuts, KeepValuesOfAnotherLayoutAside) {
  auto files = RetainFiles::open(path("state"), "line1");
  ASSERT_TRUE(files);
  ASSERT_TRUE(files->write(values(1, 5000)));
  ASSERT_TRUE(files->write(values(2, 5000)));
  mark("kept all");
  ASSERT_TRUE(files->put_aside(std::bitset<2>().set()));
  mark("kept all");
  ASSERT_TRUE(files->write(values(3, 16)));
  mark("kept all");
  ASSERT_TRUE(files->put_aside(std::bitset<2>().set()));
  mark("kept all");
  expect_no_problem();
}

class StoreUnderPowerCuts : public WritersUnderPowerCuts {
 protected:
  StoreUnderPowerCuts() {
    fs::create_directories(sent_);
    order_.folder = path("state/applications.cell/line1");
    order_.source = sent_ / "lamp.so";
    order_.name = "lamp.so";
    order_.keep = 2;
    order_.before = "/opt/lamp.so";
    order_.trial = {sent_ / "trial"};
    std::ofstream(sent_ / "trial") << "#!/bin/sh\necho \"$1 is a valid application: Lamp, 1 task\"\n";
    fs::permissions(sent_ / "trial", fs::perms::owner_all);
  }
  ~StoreUnderPowerCuts() override { fs::remove_all(sent_); }
  std::string keep(const std::string& contents) {
    std::ofstream(order_.source, std::ios::binary) << contents;
    order_.size = contents.size();
    order_.digest = sha256(contents);
    const auto kept = carry_out(order_);
    EXPECT_TRUE(kept) << kept.error().describe();
    order_.before = kept.value_or("");
    mark("kept all");
    return order_.before;
  }
  void set_boot(const std::string& application) {
    StoreOrder order = order_;
    order.boot = application;
    order.configured = "/opt/lamp.so";
    ASSERT_TRUE(carry_out(order));
    mark("kept all");
  }

  fs::path sent_ = own_path("sent");
  StoreOrder order_;
};

TEST_F(StoreUnderPowerCuts, KeepsApplicationsAndTheBootChoice) {
  const std::string first = keep(std::string(9000, 'a'));
  set_boot(first);
  const std::string second = keep(std::string(5000, 'b'));
  set_boot(second);
  (void)keep(std::string(600, 'c'));
  (void)keep(std::string(700, 'd'));
  set_boot("/opt/lamp.so");
  expect_no_problem();
}

class LogUnderPowerCuts : public WritersUnderPowerCuts {
 protected:
  [[nodiscard]] std::unique_ptr<AuditLog> open() const {
    auto log = AuditLog::open({.folder = path("state/audit.cell"), .file_bytes = 3000, .most_files = 3});
    EXPECT_TRUE(log) << log.error().describe();
    return log ? *std::move(log) : nullptr;
  }
};

TEST_F(LogUnderPowerCuts, KeepsRecordsOverFilesAndProcesses) {
  for (int process = 0; process < 2; ++process) {
    const auto log = open();
    for (int i = 0; i < 12; ++i) ASSERT_TRUE(log->append(stop_of(fmt::format("line{}", i))));
  }
  mark("kept all");
  expect_no_problem();
}

// The records of a file that is full: nobody syncs it later.
TEST_F(LogUnderPowerCuts, KeepsAFileWhenTheNextOneBegins) {
  {
    const auto log = open();
    const std::string first = path("state/audit.cell/audit.0000000001.log");
    while (fs::file_size(first) < 3000) ASSERT_TRUE(log->append(stop_of("line1")));
    ASSERT_TRUE(log->append(stop_of("line2")));
    mark("kept audit.0000000001");
  }
  expect_no_problem();
}

// A disk that has taken records and cannot keep them. The kernel may drop these, and takes the next sync,
// which has nothing to do for them, for a good one.
TEST_F(LogUnderPowerCuts, WritesRecordsAgainThatTheDiskHasNotSynced) {
  const std::string fault = own_path("disk_fault");
  ::setenv("DISK_FAULT", fault.c_str(), 1);  // NOLINT(concurrency-mt-unsafe)
  std::string last;                          // that the disk had taken when it failed
  {
    const auto log = open();
    const auto told = [&] {
      for (int looks = 0; looks < 30 && log->sync_problem().empty(); ++looks)
        std::this_thread::sleep_for(std::chrono::milliseconds(100));
      return !log->sync_problem().empty();
    };
    do {  // it may have been synced just before
      fs::remove(fault);
      ASSERT_TRUE(log->append(stop_of("line1")));
      std::ofstream(fault) << "read-only";
      last = log->head().hash;
    } while (!told());
    EXPECT_THAT(log->sync_problem(), testing::HasSubstr("cannot sync the audit log"));
    fs::remove(fault);
    mark("mended");
    while (!log->sync_problem().empty()) std::this_thread::sleep_for(std::chrono::milliseconds(10));
    mark("told");
    ASSERT_TRUE(log->append(stop_of("line2")));
  }
  ::unsetenv("DISK_FAULT");  // NOLINT(concurrency-mt-unsafe)
  const auto checked = check_audit(path("state/audit.cell"));
  ASSERT_TRUE(checked);
  EXPECT_THAT(checked->problems, IsEmpty());
  EXPECT_THAT(checked->remarks,
              testing::ElementsAre(testing::HasSubstr("records before were written again")));
  expect_real_folder();
  const auto& changes = model().all_changes();
  const auto place = [&](const char* words) {
    return std::ranges::find_if(changes, [&](const Change& change) {
      return change.kind == ChangeKind::mark && change.path == words;
    });
  };
  EXPECT_TRUE(std::any_of(place("mended"), place("told"), [&](const Change& change) {
    return change.kind == ChangeKind::write && change.other.contains(last);
  })) << "before the problem has ended";
}

TEST_F(WritersUnderPowerCuts, KeepExceptions) {
  const std::string written = own_path("line1.exception");  // in the run directory, which is memory
  const std::string file = kept_exceptions_path(exceptions_folder(path("state"), "cell"), "line1");
  for (int round = 0; round < 4; ++round) {
    ExceptionEntry entry;
    entry.unix_ns = round + 1;
    entry.task = fmt::format("Task{}", round);
    entry.text = std::string(3000, 'x');
    ASSERT_TRUE(keep_exceptions(written, std::span(&entry, 1)));
    const auto kept = keep_exceptions_on_disk(file, written);
    ASSERT_TRUE(kept) << kept.error().describe();
    mark("kept all");
  }
  fs::remove(written);
  EXPECT_EQ(read_exceptions(file)->entries.size(), 4U);
  expect_no_problem();
}

TEST_F(WritersUnderPowerCuts, MakeTheFolderOfWishesAndAllAboveIt) {
  const std::string folder = wishes_folder(path("var/state"), "cell");
  ASSERT_TRUE(make_wish_folder(folder));
  ASSERT_TRUE(replace_file(folder + "/line1.events", "Start\n", 0600));
  ASSERT_TRUE(sync_directory(folder));
  mark("kept all");
  expect_no_problem();
}

}  // namespace
}  // namespace plchost
