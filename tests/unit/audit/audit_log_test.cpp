#include "api/audit/audit_log.hpp"

#include <csignal>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <sys/resource.h>
#include <sys/stat.h>

#include "api/audit/audit_check.hpp"
#include "api/audit/audit_file.hpp"
#include "api/security/sha256.hpp"
#include "tests/support/own_name.hpp"

namespace plchost {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::string contents(const std::string& path) {
  std::ifstream file(path);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

void write(const std::string& path, const std::string& text) {
  std::ofstream(path, std::ios::trunc) << text;
}

class AuditLogTest : public ::testing::Test {
 protected:
  ~AuditLogTest() override { std::filesystem::remove_all(top); }

  [[nodiscard]] std::unique_ptr<AuditLog> open(std::size_t file_bytes = 1 << 20,
                                               std::size_t most = 64) const {
    auto log = AuditLog::open({.folder = folder, .file_bytes = file_bytes, .most_files = most});
    EXPECT_TRUE(log) << log.error().describe();
    return log ? *std::move(log) : nullptr;
  }
  static AuditRecord stop_of(const std::string& instance) {
    AuditRecord record;
    record.time_unix_ns = 1'700'000'000'123'456'789;
    record.who = "operator anna";
    record.from = "plcctl 4711, user 0, on cell3";
    record.what = "stop";
    record.on = instance;
    record.result = "ok";
    return record;
  }
  void fill(int records) const {
    const auto log = open();
    for (int i = 0; i < records; ++i) ASSERT_TRUE(log->append(stop_of(fmt::format("line{}", i))));
  }
  [[nodiscard]] AuditFindings check() const { return check_audit(folder).value(); }
  [[nodiscard]] std::string first_file() const { return audit_files(folder)->front().path; }

  std::string top = own_path("audit");
  std::string folder = top + "/log";
};

TEST(Sha256, IsThatOfTheStandard) {
  EXPECT_EQ(sha256("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}

TEST_F(AuditLogTest, KeepsWhoDidWhatFromWhereAndWhatCameOfIt) {
  fill(1);
  std::istringstream lines(contents(first_file()));
  std::string line;
  std::getline(lines, line);  // where the log begins
  std::getline(lines, line);
  const auto record = nlohmann::json::parse(line);
  EXPECT_EQ(record["n"], 2);
  EXPECT_EQ(record["time"], "2023-11-14T22:13:20.123456789Z");
  EXPECT_EQ(record["who"], "operator anna");
  EXPECT_EQ(record["from"], "plcctl 4711, user 0, on cell3");
  EXPECT_EQ(record["what"], "stop");
  EXPECT_EQ(record["on"], "line0");
  EXPECT_EQ(record["result"], "ok");
}

// Its next writer may be another user of that group.
TEST_F(AuditLogTest, IsForTheGroupWhereTheFolderIs) {
  namespace fs = std::filesystem;
  const auto rights = [&](std::uint64_t first) {
    return fs::status(folder + "/" + audit_file_name(first)).permissions() & fs::perms::mask;
  };
  auto log = open(1);
  ASSERT_TRUE(log->append(stop_of("line1")));
  EXPECT_EQ(rights(1), fs::perms::owner_read | fs::perms::owner_write);
  fs::permissions(folder, fs::perms::owner_all | fs::perms::group_all);
  ASSERT_TRUE(log->append(stop_of("line1")));
  EXPECT_EQ(rights(log->head().number),
            fs::perms::owner_read | fs::perms::owner_write | fs::perms::group_read | fs::perms::group_write);
}

TEST_F(AuditLogTest, RefusesWhatIsNoPlainFile) {
  std::filesystem::create_directories(folder);
  const std::string path = folder + "/" + audit_file_name(1);
  ASSERT_EQ(::mkfifo(path.c_str(), S_IRUSR | S_IWUSR), 0);
  const auto log = AuditLog::open({.folder = folder});
  ASSERT_FALSE(log);
  EXPECT_EQ(log.error().code, ErrorCode::wrong_type);
  EXPECT_THAT(log.error().message, HasSubstr(path + " is no plain file"));
}

TEST_F(AuditLogTest, IsOneChainOverSeveralLivesOfItsWriter) {
  for (int life = 0; life < 3; ++life) fill(5);
  const AuditFindings found = check();
  EXPECT_THAT(found.problems, IsEmpty());
  EXPECT_THAT(found.remarks, IsEmpty());
  EXPECT_EQ(found.records, 16U);
  EXPECT_EQ(found.head.number, 16U);
  EXPECT_EQ(open()->head().hash, found.head.hash);
}

TEST_F(AuditLogTest, EachChangedByteIsFound) {
  fill(3);
  const std::string whole = contents(first_file());
  for (std::size_t at = 0; at < whole.size(); ++at) {
    std::string changed = whole;
    changed[at] ^= 1;
    write(first_file(), changed);
    EXPECT_FALSE(check().problems.empty()) << "byte " << at;
  }
}

TEST_F(AuditLogTest, ARemovedAnInsertedAndAnExchangedRecordAreFound) {
  fill(4);
  std::istringstream all(contents(first_file()));
  std::vector<std::string> lines;
  for (std::string line; std::getline(all, line);) lines.push_back(line + "\n");
  const auto problems_of = [&](const std::vector<std::size_t>& order) {
    std::string text;
    for (const std::size_t i : order) text += lines[i];
    write(first_file(), text);
    return check().problems.size();
  };
  EXPECT_EQ(problems_of({0, 1, 2, 3, 4}), 0U);
  EXPECT_GT(problems_of({0, 1, 3, 4}), 0U);
  EXPECT_GT(problems_of({0, 1, 2, 2, 3, 4}), 0U);
  EXPECT_GT(problems_of({0, 2, 1, 3, 4}), 0U);
}

TEST_F(AuditLogTest, RecordsThatWereCutOffAtItsEndShowInTheHeadThatWasNoted) {
  fill(4);
  const AuditHead noted = check().head;
  const std::string whole = contents(first_file());
  write(first_file(), whole.substr(0, whole.rfind('\n', whole.size() - 2) + 1));
  EXPECT_THAT(check().problems, IsEmpty());
  EXPECT_NE(check().head.hash, noted.hash);
}

TEST_F(AuditLogTest, AWriterKilledWithinARecordCostsThatRecordOnlyWhereverItWas) {
  fill(2);
  const std::string whole = contents(first_file());
  const std::size_t last = whole.rfind('\n', whole.size() - 2) + 1;
  for (std::size_t cut = last + 1; cut < whole.size(); ++cut) {
    write(first_file(), whole.substr(0, cut));
    ASSERT_TRUE(open()->append(stop_of("line9")));
    const AuditFindings found = check();
    ASSERT_THAT(found.problems, IsEmpty()) << "cut at " << cut;
    const bool lost = cut + 1 < whole.size();  // else only its newline is
    ASSERT_EQ(found.remarks.size(), lost ? 1U : 0U) << "cut at " << cut;
    ASSERT_EQ(found.head.number, 4U);
  }
}

// As a power cut leaves it: more than one look at the end of the file takes.
TEST_F(AuditLogTest, GoesOnBehindMoreZerosThanRecordsHaveBytes) {
  fill(2);
  const std::string whole = contents(first_file());
  for (const std::size_t zeros : {std::size_t{1}, std::size_t{100'000}, std::size_t{300'000}}) {
    write(first_file(), whole + std::string(zeros, '\0'));
    ASSERT_TRUE(open()->append(stop_of("line9")));
    const AuditFindings found = check();
    ASSERT_THAT(found.problems, IsEmpty()) << zeros << " zeros";
    ASSERT_EQ(found.remarks.size(), 1U);
    ASSERT_EQ(found.head.number, 5U);
  }
}

TEST_F(AuditLogTest, GoesOnBehindSeveralLinesThatCannotBeRead) {
  fill(2);
  std::ofstream(first_file(), std::ios::app) << std::string(600, '\0') << "\"}\n{\"n\":7\n{";
  ASSERT_TRUE(open()->append(stop_of("line9")));
  EXPECT_THAT(check().problems, IsEmpty());
  EXPECT_THAT(check().remarks, ElementsAre(HasSubstr("a record before was not completed")));
}

TEST_F(AuditLogTest, IsOneChainOverAFileThatGotNoRecordBeforeThePowerWasCut) {
  fill(2);
  for (const std::string_view left : {"", "half a rec"}) {
    const auto files = audit_files(folder).value();
    const auto head = check().head.number;
    write(folder + "/" + audit_file_name(head + 1), std::string(left));
    ASSERT_TRUE(open()->append(stop_of("line9")));
    EXPECT_EQ(audit_files(folder)->size(), files.size() + 1);
    EXPECT_THAT(check().problems, IsEmpty());
    EXPECT_EQ(check().head.number, head + 2);
  }
}

TEST_F(AuditLogTest, GoesOnInTheNextFileAndRemovesTheOldest) {
  {
    const auto log = open(1000, 3);
    for (int i = 0; i < 50; ++i) ASSERT_TRUE(log->append(stop_of("line1")));
  }
  EXPECT_EQ(audit_files(folder)->size(), 3U);
  const AuditFindings found = check();
  EXPECT_THAT(found.problems, IsEmpty());
  EXPECT_GT(found.first, 1U);
  EXPECT_EQ(found.head.number, 51U);
}

TEST_F(AuditLogTest, ARemovedFileInBetweenIsFound) {
  {
    const auto log = open(1000);
    for (int i = 0; i < 20; ++i) ASSERT_TRUE(log->append(stop_of("line1")));
  }
  std::filesystem::remove((*audit_files(folder))[1].path);
  EXPECT_THAT(check().problems, ElementsAre(HasSubstr("follows record")));
}

TEST_F(AuditLogTest, WhatCannotBeWrittenIsCountedInTheChain) {
  const auto log = open();
  rlimit before{};
  ::getrlimit(RLIMIT_FSIZE, &before);
  const rlimit none{.rlim_cur = std::filesystem::file_size(first_file()), .rlim_max = before.rlim_max};
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  ::setrlimit(RLIMIT_FSIZE, &none);
  EXPECT_FALSE(log->append(stop_of("line1")));
  EXPECT_FALSE(log->append(stop_of("line2")));
  ::setrlimit(RLIMIT_FSIZE, &before);
  (void)std::signal(SIGXFSZ, handler);
  EXPECT_TRUE(log->append(stop_of("line3")));
  EXPECT_THAT(contents(first_file()), HasSubstr("2 records could not be written"));
  EXPECT_THAT(check().problems, IsEmpty());
  EXPECT_THAT(check().remarks, ElementsAre(HasSubstr("could not be written")));
}

TEST_F(AuditLogTest, HasOneWriter) {
  const auto log = open();
  const auto second = AuditLog::open({.folder = folder});
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().code, ErrorCode::busy);
}

TEST_F(AuditLogTest, IsReadByItsOwnerOnly) {
  fill(1);
  EXPECT_EQ(std::filesystem::status(folder).permissions(), std::filesystem::perms::owner_all);
  EXPECT_EQ(std::filesystem::status(first_file()).permissions(),
            std::filesystem::perms::owner_read | std::filesystem::perms::owner_write);
}

TEST_F(AuditLogTest, TakesTextsThatAreNoUtf8) {
  {
    AuditRecord record = stop_of("line1");
    record.argument = "\xff\x1b[2J\n\"";
    ASSERT_TRUE(open()->append(record));
  }
  EXPECT_THAT(check().problems, IsEmpty());
}

TEST_F(AuditLogTest, AFolderWithoutALogIsSaidToBeNone) {
  std::filesystem::create_directories(folder);
  EXPECT_EQ(check_audit(folder).error().code, ErrorCode::not_found);
  EXPECT_EQ(check_audit(folder + "/no").error().code, ErrorCode::system);
}

}  // namespace
}  // namespace plchost
