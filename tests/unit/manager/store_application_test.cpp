#include "manager/store/store_application.hpp"

#include <csignal>
#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <sys/resource.h>
#include <unistd.h>

#include "api/control/application_versions.hpp"
#include "api/security/sha256.hpp"
#include "tests/support/own_name.hpp"

namespace plchost {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr const char* kValid = "echo \"$2 is a valid application: Lamp, 1 task\"";

class StoreApplication : public testing::Test {
 protected:
  StoreApplication() {
    root_ = own_path("store");
    std::filesystem::create_directories(root_);
    order_.folder = root_ / "applications.cell" / "line1";
    order_.source = root_ / "sent";
    order_.name = "lamp.so";
    order_.by = "engineer otto";
    order_.keep = 3;
    order_.before = "/opt/lamp.so";
    set_trial(kValid);
    send("contents");
  }
  ~StoreApplication() override { std::filesystem::remove_all(root_); }

  void send(const std::string& contents) {
    std::ofstream(order_.source, std::ios::binary) << contents;
    order_.size = contents.size();
    order_.digest = sha256(contents);
  }
  /// In the place of plc-instance.
  void set_trial(const std::string& script) {
    const std::string program = root_ / "trial";
    order_.trial = {program, "--check-application"};
    std::ofstream(program) << "#!/bin/sh\n" << script << "\n";
    std::filesystem::permissions(program, std::filesystem::perms::owner_all);
  }
  /// Sends and keeps it, as what is loaded from then on.
  std::string keep(const std::string& contents) {
    send(contents);
    const auto path = carry_out(order_);
    EXPECT_TRUE(path) << path.error().describe();
    order_.before = path.value_or("");
    return order_.before;
  }
  [[nodiscard]] std::vector<std::uint32_t> numbers() const {
    std::vector<std::uint32_t> all;
    for (const ApplicationVersion& version : read_versions(order_.folder).kept) all.push_back(version.number);
    return all;
  }
  [[nodiscard]] std::vector<std::string> files() const {
    std::vector<std::string> all;
    std::error_code error;
    for (const auto& entry : std::filesystem::directory_iterator(order_.folder, error)) {
      all.push_back(entry.path().filename().string());
    }
    return all;
  }
  static std::string text_of(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }

  std::filesystem::path root_;
  StoreOrder order_;
};

TEST_F(StoreApplication, PutsTheFileInPlaceWithAllThatIsKnownOfIt) {
  const auto path = carry_out(order_);
  ASSERT_TRUE(path) << path.error().describe();
  EXPECT_EQ(*path, order_.folder + "/000001.so");
  EXPECT_EQ(text_of(*path), "contents");
  const auto versions = read_versions(order_.folder);
  ASSERT_EQ(versions.kept.size(), 1U);
  const ApplicationVersion& version = versions.kept.front();
  EXPECT_EQ(version.path, *path);
  EXPECT_EQ(version.name, "lamp.so");
  EXPECT_EQ(version.by, "engineer otto");
  EXPECT_EQ(version.digest, order_.digest);
  EXPECT_EQ(version.size, 8U);
  EXPECT_EQ(version.before, "/opt/lamp.so");
  EXPECT_GT(version.stored_unix_ns, 0);
  EXPECT_EQ(versions.boot, "");
  const auto perms = std::filesystem::status(*path).permissions();
  EXPECT_EQ(perms & std::filesystem::perms::others_all, std::filesystem::perms::none);
}

// The API server reads descriptions, and may have another user.
TEST_F(StoreApplication, HasTheRightsOfTheGroupThatReadsTheFolderOfTheHost) {
  namespace fs = std::filesystem;
  const auto rights = [&](const fs::path& path) {
    return fs::status(path).permissions() & fs::perms::group_all;
  };
  const std::string own = keep("own");
  EXPECT_EQ(rights(own), fs::perms::none);
  EXPECT_EQ(rights(root_ / "applications.cell"), fs::perms::none);
  fs::permissions(root_ / "applications.cell",
                  fs::perms::owner_all | fs::perms::group_read | fs::perms::group_exec);
  order_.folder = root_ / "applications.cell" / "line2";
  order_.earlier.clear();
  const std::string shared = keep("shared");
  EXPECT_EQ(rights(description_path(shared)), fs::perms::group_read);
  EXPECT_EQ(rights(order_.folder), fs::perms::group_read | fs::perms::group_exec);
  EXPECT_EQ(rights(root_ / "applications.cell"), fs::perms::group_read | fs::perms::group_exec);
}

// The second one has not come up, and the third one may not either.
TEST_F(StoreApplication, KeepsWhatTheInstanceMayGoBackTo) {
  order_.keep = 1;
  const std::string first = keep("first");
  order_.earlier = first;
  const std::string second = keep("second");
  const std::string third = keep("third");
  EXPECT_EQ(text_of(first), "first");
  EXPECT_EQ(text_of(second), "second");
  order_.earlier = third;
  keep("fourth");
  EXPECT_FALSE(std::filesystem::exists(first));
}

TEST_F(StoreApplication, RefusesWhatHasAnotherDigestThanWasAnnounced) {
  std::ofstream(order_.source, std::ios::binary) << "contentz";
  const auto path = carry_out(order_);
  ASSERT_FALSE(path);
  EXPECT_EQ(path.error().code, ErrorCode::corrupt);
  EXPECT_THAT(path.error().message, HasSubstr("SHA-256"));
  EXPECT_THAT(files(), IsEmpty());
}

TEST_F(StoreApplication, RefusesWhatIsShorterThanWasAnnounced) {
  order_.size += 1;
  const auto path = carry_out(order_);
  ASSERT_FALSE(path);
  EXPECT_EQ(path.error().code, ErrorCode::corrupt);
  EXPECT_THAT(files(), IsEmpty());
}

TEST_F(StoreApplication, TakesNoLinkAndNoDevice) {
  std::filesystem::remove(order_.source);
  std::filesystem::create_symlink("/etc/hostname", order_.source);
  EXPECT_EQ(carry_out(order_).error().code, ErrorCode::system);
  order_.source = "/dev/zero";
  EXPECT_EQ(carry_out(order_).error().code, ErrorCode::wrong_type);
}

TEST_F(StoreApplication, TellsTheTrialsWordsWithTheNameThatTheSenderKnows) {
  set_trial("echo \"$2 is for another machine\"; exit 1");
  const auto path = carry_out(order_);
  ASSERT_FALSE(path);
  EXPECT_EQ(path.error().code, ErrorCode::invalid_argument);
  EXPECT_EQ(path.error().message, "lamp.so is refused: lamp.so is for another machine");
  EXPECT_THAT(files(), IsEmpty());
}

TEST_F(StoreApplication, NamesTheFileOnceAndTellsItAllInOneLine) {
  set_trial("echo 'error: application: no valve'; echo \"$2: it crashes\"; exit 3");
  EXPECT_EQ(carry_out(order_).error().message,
            "lamp.so is refused: error: application: no valve; lamp.so: it crashes");
  set_trial("echo \"$2: it crashes\"; exit 3");
  EXPECT_EQ(carry_out(order_).error().message, "lamp.so is refused: it crashes");
}

TEST_F(StoreApplication, TakesTheBootApplicationBackForThatOfTheConfiguration) {
  order_.configured = "/opt/configured.so";
  order_.boot = "/opt/other.so";
  ASSERT_TRUE(carry_out(order_));
  EXPECT_EQ(read_boot(order_.folder), "/opt/other.so");
  order_.boot = order_.configured;
  for (int again = 0; again < 2; ++again) {
    ASSERT_TRUE(carry_out(order_));
    EXPECT_EQ(read_boot(order_.folder), "");
  }
}

TEST_F(StoreApplication, TellsHowATrialEndedThatSaidNothing) {
  set_trial("kill -SEGV $$");
  EXPECT_THAT(carry_out(order_).error().message, HasSubstr("killed by SIGSEGV"));
}

TEST_F(StoreApplication, RefusesWhatEndsItsTrialAsIfAllWereWell) {
  set_trial("exit 0");
  const auto path = carry_out(order_);
  ASSERT_FALSE(path);
  EXPECT_EQ(path.error().message, "lamp.so is refused: it ends its process in its set-up (exit code 0)");
  EXPECT_THAT(files(), IsEmpty());
}

TEST_F(StoreApplication, EndsWhatATrialLeavesBehind) {
  const std::string left = root_ / "left";
  set_trial("sleep 600 & echo $! >" + left + "; " + kValid);
  ASSERT_TRUE(carry_out(order_));
  const pid_t pid = std::stoi(text_of(left));
  const auto lives = [pid] {  // a zombie does not
    const std::string status = text_of("/proc/" + std::to_string(pid) + "/status");
    return !status.empty() && status.find("State:\tZ") == std::string::npos;
  };
  for (int i = 0; i < 1000 && lives(); ++i) ::usleep(10'000);
  EXPECT_FALSE(lives());
}

TEST_F(StoreApplication, TakesAnApplicationThatSaysALotAtItsStart) {
  set_trial("head -c 200000 /dev/zero | tr '\\0' x; " + std::string(kValid));
  const auto path = carry_out(order_);
  EXPECT_TRUE(path) << path.error().describe();
}

TEST_F(StoreApplication, GivesTheNextNumberAndRemovesTheOldestBeyondTheBound) {
  for (const char* contents : {"a", "b", "c", "d", "e"}) keep(contents);
  EXPECT_THAT(numbers(), ElementsAre(3, 4, 5));
  EXPECT_EQ(files().size(), 6U);
}

TEST_F(StoreApplication, KeepsTheBootApplicationAndWhatIsLoadedBeyondTheBound) {
  order_.keep = 1;
  StoreOrder boot = order_;
  boot.boot = keep("a");
  ASSERT_TRUE(carry_out(boot));
  const std::string loaded = keep("b");
  keep("c");
  EXPECT_THAT(numbers(), ElementsAre(1, 2, 3));
  keep("d");
  EXPECT_THAT(numbers(), ElementsAre(1, 3, 4));
}

TEST_F(StoreApplication, IsNotKeptTwiceWhenItIsLoadedAlready) {
  const std::string first = keep("a");
  EXPECT_EQ(keep("a"), first);
  EXPECT_THAT(numbers(), ElementsAre(1));
  EXPECT_EQ(files().size(), 2U);
  keep("b");
  EXPECT_EQ(keep("a"), order_.folder + "/000003.so");
}

TEST_F(StoreApplication, RemovesWhatAKilledHelperHasLeft) {
  keep("a");
  std::ofstream(order_.folder + "/000002.so.part") << "half";
  std::ofstream(order_.folder + "/000002.so") << "not described";
  keep("b");
  EXPECT_THAT(files(), testing::UnorderedElementsAre("000001.so", "000001.json", "000002.so", "000002.json"));
  EXPECT_EQ(text_of(order_.folder + "/000002.so"), "b");
}

TEST_F(StoreApplication, DoesNotCountWhatHasADamagedDescription) {
  keep("a");
  std::ofstream(order_.folder + "/000001.json") << "{";
  EXPECT_THAT(numbers(), IsEmpty());
}

TEST_F(StoreApplication, SaysWhereItCouldNotWrite) {
  std::ofstream(root_ / "applications.cell") << "a file, no folder";
  const auto path = carry_out(order_);
  ASSERT_FALSE(path);
  EXPECT_EQ(path.error().code, ErrorCode::system);
  EXPECT_THAT(path.error().describe(), HasSubstr("applications.cell"));
}

TEST_F(StoreApplication, LeavesNothingWhenTheDiskIsFull) {
  keep("a");
  rlimit before{};
  ::getrlimit(RLIMIT_FSIZE, &before);
  const auto old = std::signal(SIGXFSZ, SIG_IGN);
  send(std::string(100'000, 'x'));
  const rlimit small{.rlim_cur = 4096, .rlim_max = before.rlim_max};
  ::setrlimit(RLIMIT_FSIZE, &small);
  const auto path = carry_out(order_);
  ::setrlimit(RLIMIT_FSIZE, &before);
  (void)std::signal(SIGXFSZ, old);
  ASSERT_FALSE(path);
  EXPECT_EQ(path.error().code, ErrorCode::system);
  EXPECT_THAT(path.error().message, HasSubstr("write "));
  EXPECT_THAT(files(), testing::UnorderedElementsAre("000001.so", "000001.json"));
}

TEST_F(StoreApplication, RemembersTheBootApplication) {
  order_.boot = "/opt/other.so";
  EXPECT_EQ(carry_out(order_).value(), "/opt/other.so");
  EXPECT_EQ(read_boot(order_.folder), "/opt/other.so");
  EXPECT_THAT(numbers(), IsEmpty());
}

TEST(StoreOrder, SurvivesTheRoundTrip) {
  StoreOrder order;
  order.parent = 4711;
  order.folder = "/state/\"x\"";
  order.source = "/dev/shm/x";
  order.size = 1ULL << 40U;
  order.keep = 5;
  order.name = "l\xc3\xa4mp.so";
  order.trial = {"/usr/bin/plc-instance", "--name", "line \"1\""};
  order.trial_group = "/sys/fs/cgroup/p:trial:line1";
  const auto decoded = decode_store_order(encode(order));
  ASSERT_TRUE(decoded);
  EXPECT_EQ(decoded->parent, 4711);
  EXPECT_EQ(decoded->folder, order.folder);
  EXPECT_EQ(decoded->source, order.source);
  EXPECT_EQ(decoded->size, order.size);
  EXPECT_EQ(decoded->keep, 5U);
  EXPECT_EQ(decoded->name, order.name);
  EXPECT_EQ(decoded->trial, order.trial);
  EXPECT_EQ(decoded->trial_group, order.trial_group);
  for (const char* bad : {"", "{}", "[]", "{\"size\":-1}"}) {
    EXPECT_EQ(decode_store_order(bad).error().code, ErrorCode::corrupt);
  }
}

}  // namespace
}  // namespace plchost
