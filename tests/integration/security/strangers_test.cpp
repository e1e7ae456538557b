// Clients that are not let in at all.
#include <ctime>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <thread>

#include <fmt/format.h>

#include "tests/integration/security/secured_host.hpp"

namespace plchost {
namespace {

using security::SecurityFolder;
using testing::HasSubstr;
using testing::IsEmpty;

class Strangers : public SecuredHost {
 protected:
  /// Once an operator is served, all others that are served have been.
  void operator_is_served() { EXPECT_TRUE(sees_host(folder("operator"))); }
};

TEST_F(Strangers, WithoutACertificateSeeNobody) {
  start();
  EXPECT_FALSE(sees_host("", "2"));
  operator_is_served();
}

TEST_F(Strangers, WithACertificateOfAnotherAuthoritySeeNobody) {
  start();
  const std::string other = base_ + "/other";
  ASSERT_TRUE(SecurityFolder::init(other, "cell"));
  ASSERT_TRUE(SecurityFolder::open(other)->add(security::Role::admin, "admin"));
  EXPECT_FALSE(sees_host(other + "/admin", "2"));
  operator_is_served();
}

// It trusts this plant's authority, and has a certificate that another signed for the same subject.
TEST_F(Strangers, WithAForgedSubjectMeetNobody) {
  start();
  const std::string other = base_ + "/other";
  ASSERT_TRUE(SecurityFolder::init(other, "cell"));
  ASSERT_TRUE(SecurityFolder::open(other)->add(security::Role::operating, "operator"));
  for (const char* const file : {"permissions_ca.pem", "governance.p7s", "permissions.p7s"}) {
    std::filesystem::copy_file(folder("operator") + "/" + file, other + "/operator/" + file,
                               std::filesystem::copy_options::overwrite_existing);
  }
  {
    RawClient client(domain_, other + "/operator", /*patched=*/true);
    ASSERT_TRUE(client.is_in_domain());
    EXPECT_FALSE(
        RawClient::meets_reader(client.write(dds::kOperatorRequest, "h.cell"), std::chrono::seconds(2)));
  }
  operator_is_served();
}

// The same client as below, so that it is known what it fails for.
TEST_F(Strangers, ThatWereThereBeforeTheHostMeetItIfTheirCertificateIsValid) {
  RawClient client(domain_, folder("operator"));
  const auto writer = client.write(dds::kOperatorRequest, "h.cell");
  start();
  EXPECT_TRUE(RawClient::meets_reader(writer));
}

TEST_F(Strangers, WhoseCertificateHasExpiredMeetNobody) {
  std::unique_ptr<RawClient> client;
  std::string name;
  std::time_t end = 0;
  // A machine that is too slow for a certificate gets a longer one.
  for (const int validity : {2, 10, 40}) {
    name = fmt::format("late{}", validity);
    const std::time_t now = std::time(nullptr);
    end = now + validity;
    ASSERT_TRUE(plant().add_valid({.role = security::Role::operating, .name = name}, {now - 10, end}));
    // Made while it was valid: its own side has nothing against it.
    client.reset();
    client = std::make_unique<RawClient>(domain_, folder(name));
    if (client->is_in_domain()) break;
  }
  ASSERT_TRUE(client->is_in_domain());
  const auto writer = client->write(dds::kOperatorRequest, "h.cell");
  while (std::time(nullptr) <= end) std::this_thread::sleep_for(std::chrono::milliseconds(50));
  start();
  operator_is_served();
  EXPECT_FALSE(RawClient::meets_reader(writer, std::chrono::seconds(2)));
  EXPECT_THAT(run(name, {"list", "hosts"}).errors, HasSubstr("certificate has expired"));
}

TEST_F(Strangers, WhoseCertificateEndsWhileTheyAreServedAreServedNoMore) {
  start();
  std::unique_ptr<ControlClient> client;
  std::string why;
  std::time_t end = 0;
  // A machine that is too slow for a certificate gets a longer one.
  for (const int validity : {3, 20, 60}) {
    const std::string name = fmt::format("brief{}", validity);
    const std::time_t now = std::time(nullptr);
    end = now + validity;
    ASSERT_TRUE(plant().add_valid({.role = security::Role::operating, .name = name}, {now - 10, end}));
    dds::DomainOptions options;
    options.domain = domain_.number();
    options.identity = folder(name);
    client = ControlClient::connect(options).value();
    const auto patience = std::chrono::seconds(validity);
    bool served = false;
    // The server looks twice in a second whether its folder has new identities.
    for (const TimePoint last = MonotonicClock::now() + patience; !served && MonotonicClock::now() < last;) {
      const auto posted = client->post_event({"cell", "line1", "ready"}, 1, {}, patience);
      served = posted && posted->accepted == 1;
      why = posted ? posted->rejected_text : posted.error().describe();
    }
    if (served) break;
    client.reset();
  }
  ASSERT_TRUE(client) << "none was served; the last one: " << why;
  while (std::time(nullptr) <= end) std::this_thread::sleep_for(std::chrono::milliseconds(50));
  const auto refused = client->post_event({"cell", "line1", "ready"}, 1, {}, std::chrono::seconds(1));
  EXPECT_TRUE(!refused || refused->accepted == 0);
  EXPECT_EQ(event_.counted().count(), 1U);
}

TEST_F(Strangers, WithThePermissionsOfAnotherAreRefused) {
  start();
  std::filesystem::copy_file(folder("admin") + "/permissions.p7s", folder("operator") + "/permissions.p7s",
                             std::filesystem::copy_options::overwrite_existing);
  EXPECT_THAT(run("operator", {"list", "hosts"}).errors, HasSubstr("permissions of another identity"));
  {
    RawClient client(domain_, folder("operator"), /*patched=*/true);
    const bool met =
        client.is_in_domain() &&
        RawClient::meets_reader(client.write(dds::kEngineerRequest, "h.cell"), std::chrono::seconds(2));
    EXPECT_FALSE(met);
  }
  EXPECT_TRUE(sees_host(folder("viewer")));
}

TEST_F(Strangers, ThatWereRevokedSeeNobodyAfterTheServerBeganWithTheNewList) {
  const std::string copy = base_ + "/kept";
  std::filesystem::copy(folder("operator"), copy);
  start();
  ASSERT_TRUE(sees_host(copy));
  ASSERT_TRUE(plant().revoke("operator"));
  EXPECT_EQ(host_.server().wait(), 0) << "it ends in order, and its manager starts it again";
  start();
  EXPECT_TRUE(sees_host(folder("viewer")));
  EXPECT_FALSE(sees_host(copy, "2"));
  EXPECT_THAT(run("operator", {"list", "hosts"}).errors, HasSubstr("certificate revoked"));
}

TEST_F(Strangers, WithAnOlderCertificateOfARevokedNameSeeNobodyAlsoWhenTheNameIsThereAgain) {
  const std::string copy = base_ + "/kept";
  std::filesystem::copy(folder("operator"), copy);
  ASSERT_TRUE(plant().renew("operator"));
  start();
  ASSERT_TRUE(sees_host(copy)) << "until the name is revoked";
  ASSERT_TRUE(plant().revoke("operator"));
  ASSERT_TRUE(plant().add(security::Role::operating, "operator"));
  EXPECT_EQ(host_.server().wait(), 0) << "it ends in order, and its manager starts it again";
  start();
  operator_is_served();
  EXPECT_FALSE(sees_host(copy, "2"));
}

TEST_F(Strangers, ThatTheHostsFolderDoesNotKnowAreToldSoUntilItDoes) {
  const std::string known = folder("cell") + "/known/operator.pem";
  std::filesystem::rename(known, base_ + "/operator.pem");
  start();
  const pid_t server = host_.server().pid();
  const auto refused = run("operator", {"stop", "instance", "line1"});
  EXPECT_EQ(refused.code, 1);
  EXPECT_THAT(refused.errors, HasSubstr("does not know your identity"));
  EXPECT_THAT(host_.requests(), IsEmpty());
  std::filesystem::rename(base_ + "/operator.pem", known);
  const TimePoint end = soon();
  while (run("operator", {"stop", "instance", "line1"}).code != 0 && MonotonicClock::now() < end) continue;
  EXPECT_EQ(host_.requests().size(), 1U);
  EXPECT_EQ(::kill(server, 0), 0) << "it takes no fresh process";
}

TEST_F(Strangers, ABrokenFileInTheHostsFolderChangesNothing) {
  start();
  operator_is_served();
  std::ofstream(folder("cell") + "/certificate.pem") << "broken\n";
  std::this_thread::sleep_for(std::chrono::seconds(2));
  operator_is_served();
}

TEST_F(Strangers, AClientsIdentityMakesNoHost) {
  host_.start_server({"--identity", folder("admin")});
  EXPECT_EQ(host_.server().wait(), 1);
}

TEST_F(Strangers, FromANetworkAreLetInUnsecuredOnlyIfThatWasSaid) {
  const std::vector<std::string> arguments{"--host",          "cell",
                                           "--domain",        std::to_string(domain_.number()),
                                           "--pool",          host_.pool_name(),
                                           "--run-directory", host_.run_directory(),
                                           "--interface",     "nowhere0"};
  const auto refused = run_program(PLCHOST_DDS_PROGRAM, arguments);
  EXPECT_EQ(refused.code, 1);
  EXPECT_THAT(refused.errors, HasSubstr("open to all who reach interface nowhere0"));
}

}  // namespace
}  // namespace plchost
