// The API server becomes another user for good.
#include "api/server/access/own_user.hpp"

#include <fstream>
#include <string>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include "tests/support/in_a_child.hpp"

namespace plchost {
namespace {

using testing::Contains;
using testing::HasSubstr;

constexpr int kMostFifoOfServer = 21;

std::string become(const std::string& user) {
  const auto done =
      become_user({.user = user, .most_fifo = kMostFifoOfServer, .files = {.read = {"/proc"}, .write = {}}});
  return done ? "" : done.error().describe();
}

class OwnUserTest : public testing::Test {
 protected:
  void SetUp() override {
    if (::geteuid() != 0) GTEST_SKIP() << "only root becomes another user";
  }
};

TEST_F(OwnUserTest, HasNoWayBack) {
  EXPECT_EQ(in_a_child([] {
              const std::string wrong = become("65534");
              if (!wrong.empty()) return wrong;
              const bool back = ::setuid(0) == 0 || ::seteuid(0) == 0;
              return fmt::format("{} {} {}", ::getuid(), ::geteuid(), back);
            }),
            "65534 65534 false");
}

TEST_F(OwnUserTest, KeepsTheGroupAndNoCapability) {
  EXPECT_EQ(in_a_child([] {
              if (::setegid(64041) != 0) return std::string("no other group");
              const std::string wrong = become("nobody");
              if (!wrong.empty()) return wrong;
              std::string rights;
              std::ifstream status("/proc/self/status");
              for (std::string line; std::getline(status, line);) {
                if (line.starts_with("CapPrm") || line.starts_with("NoNewPrivs")) rights += line + " ";
              }
              return fmt::format("{} {}", ::getegid(), rights);
            }),
            "64041 CapPrm:\t0000000000000000 NoNewPrivs:\t1 ");
}

TEST_F(OwnUserTest, StaysBelowEachTask) {
  const rlimit much{.rlim_cur = 99, .rlim_max = 99};
  if (in_a_child([&] { return ::setrlimit(RLIMIT_RTPRIO, &much) == 0 ? "" : "refused"; }) != "") {
    GTEST_SKIP() << "needs CAP_SYS_RESOURCE";
  }
  EXPECT_EQ(in_a_child([&] {
              (void)::setrlimit(RLIMIT_RTPRIO, &much);
              const std::string wrong = become("65534");
              rlimit left{};
              (void)::getrlimit(RLIMIT_RTPRIO, &left);
              return fmt::format("{}{} {}", wrong, left.rlim_cur, left.rlim_max);
            }),
            "21 21");
}

TEST_F(OwnUserTest, GivesItsFilesToTheGroup) {
  EXPECT_EQ(in_a_child([] {
              const std::string wrong = become("65534");
              return fmt::format("{}{:o}", wrong, ::umask(0));
            }),
            "27");
}

TEST_F(OwnUserTest, IsNeitherRootNorNobodyKnown) {
  EXPECT_THAT(in_a_child([] { return become("root"); }), HasSubstr("root is no user with fewer rights"));
  EXPECT_THAT(in_a_child([] { return become("0"); }), HasSubstr("root is no user with fewer rights"));
  EXPECT_THAT(in_a_child([] { return become("nobody here"); }), HasSubstr("there is no user 'nobody here'"));
}

TEST_F(OwnUserTest, IsRefusedToThoseWhoAreNotRoot) {
  EXPECT_THAT(in_a_child([] {
                if (::setresuid(65534, 65534, 65534) != 0) return std::string("no other user");
                return become("65533");
              }),
              HasSubstr("takes root with CAP_SETUID and CAP_SETGID"));
}

TEST(FilesOfTheServer, AreThoseOfItsFolders) {
  const FileView files = files_of_server({.run = "/run/cell",
                                          .audit = "/var/lib/cell/audit.cell",
                                          .applications = "/var/lib/cell/applications.cell",
                                          .identity = "/etc/cell/identity"});
  EXPECT_THAT(files.read,
              testing::IsSupersetOf({"/run/cell", "/var/lib/cell/applications.cell", "/etc/cell"}));
  EXPECT_THAT(files.write, testing::ElementsAre("/dev/null", "/dev/shm", "/var/lib/cell/audit.cell"));
  EXPECT_THAT(files.read, testing::Not(Contains("/etc")));
}

}  // namespace
}  // namespace plchost
