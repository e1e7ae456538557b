// The rights of each role, and the refusals: with real processes over loopback.
#include <filesystem>
#include <fstream>

#include "api/security/pem.hpp"
#include "api/security/policy.hpp"
#include "api/security/signed_document.hpp"
#include "shm/pages/log_ring.hpp"
#include "tests/integration/security/secured_host.hpp"

namespace plchost {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

class Roles : public SecuredHost {
 protected:
  Roles() { start(); }
};

TEST_F(Roles, AViewerReadsStatus) {
  const auto listed = run("viewer", {"list", "instances"});
  EXPECT_EQ(listed.code, 0) << listed.errors;
  EXPECT_THAT(listed.output, HasSubstr("line1"));
}

TEST_F(Roles, AViewerThatPostsOrStopsIsRefused) {
  for (const std::vector<std::string>& words : {std::vector<std::string>{"post", "event", "line1/ready"},
                                                {"stop", "instance", "line1"},
                                                {"logs", "line1"}}) {
    const auto refused = run("viewer", words);
    EXPECT_EQ(refused.code, 1);
    EXPECT_THAT(refused.errors, HasSubstr("the permissions of this identity do not allow it"));
  }
  EXPECT_EQ(event_.counted().count(), 0U);
  EXPECT_THAT(host_.requests(), IsEmpty());
}

TEST_F(Roles, AnOperatorPostsAndStops) {
  const auto posted = run("operator", {"post", "event", "line1/ready", "--count", "100"});
  EXPECT_EQ(posted.code, 0) << posted.errors;
  EXPECT_EQ(event_.counted().count(), 100U);
  const auto stopped = run("operator", {"stop", "instance", "line1"});
  EXPECT_EQ(stopped.code, 0) << stopped.errors;
  EXPECT_THAT(host_.requests(), SizeIs(1));
}

TEST_F(Roles, AnOperatorReadsWhatAnInstanceSays) {
  auto ring = LogRing::open(host_.pool_name(), "line1").value();
  ring.add({.time_unix_ns = 1, .text = "valve 7 is stuck"});
  const auto read = run("operator", {"logs", "line1"});
  EXPECT_EQ(read.code, 0) << read.errors;
  EXPECT_THAT(read.output, HasSubstr("valve 7 is stuck"));
  LogRing::remove(host_.pool_name(), "line1");
}

TEST_F(Roles, AnOperatorThatLoadsIsRefused) {
  const auto refused = run("operator", {"load", "application", "line1", "/tmp/other.so", "--on-host"});
  EXPECT_EQ(refused.code, 1);
  const auto sent =
      run("operator", {"load", "application", "line1", folder("operator") + "/certificate.pem"});
  EXPECT_EQ(sent.code, 1);
  EXPECT_THAT(sent.errors, HasSubstr("plc/v1/eng/download_chunk: the permissions of this identity"));
  EXPECT_THAT(refused.errors, HasSubstr("plc/v1/eng/request: the permissions of this identity"));
  EXPECT_THAT(host_.requests(), IsEmpty());
}

TEST_F(Roles, AnEngineerAndAnAdminDoAll) {
  for (const char* const who : {"engineer", "admin"}) {
    const auto posted = run(who, {"post", "event", "line1/ready"});
    EXPECT_EQ(posted.code, 0) << posted.errors;
    const auto loaded = run(who, {"load", "application", "line1", "/tmp/other.so", "--on-host"});
    EXPECT_EQ(loaded.code, 0) << loaded.errors;
    const auto sent = run(who, {"load", "application", "line1", folder(who) + "/certificate.pem"});
    EXPECT_EQ(sent.code, 0) << sent.errors;
  }
  EXPECT_EQ(event_.counted().count(), 2U);
  ASSERT_THAT(host_.requests(), SizeIs(4));
  EXPECT_EQ(host_.requests()[1].options.at("by"), "engineer engineer");
}

TEST_F(Roles, AParticipantsGuidBeginsAsItsIdentityHasIt) {
  const RawClient client(domain_, folder("operator"));
  const auto certificate = security::read_certificate(folder("operator") + "/certificate.pem").value();
  const auto prefix = security::guid_prefix(certificate).value();
  EXPECT_TRUE(std::equal(prefix.begin(), prefix.end(), client.guid().bytes.begin()));
}

TEST_F(Roles, APatchedClientMeetsNobodyWhereItsRoleDoesNotReach) {
  RawClient client(domain_, folder("operator"), /*patched=*/true);
  ASSERT_TRUE(client.is_in_domain());
  const auto own = client.write(dds::kOperatorRequest, "h.cell");
  const auto forbidden = client.write(dds::kEngineerRequest, "h.cell");
  const auto chunks = client.write(dds::kDownloadChunk, "h.cell");
  const auto presence = client.write(dds::kPresence, "s.cell");
  const auto others = client.read(dds::kReply, "c.*");
  const auto own_replies =
      client.read(dds::kReply, dds::client_partition(client.guid().hex(), dds::kAllHosts));
  ASSERT_TRUE(own > 0 && forbidden > 0 && chunks > 0 && presence > 0 && others > 0)
      << "it is not patched enough";
  EXPECT_TRUE(RawClient::meets_reader(own)) << "its own topics do not work either";
  EXPECT_TRUE(RawClient::meets_writer(own_replies));
  EXPECT_FALSE(RawClient::meets_reader(forbidden, std::chrono::seconds(1)));
  EXPECT_FALSE(RawClient::meets_reader(chunks, std::chrono::seconds(0)));
  EXPECT_FALSE(RawClient::meets_reader(presence, std::chrono::seconds(0)));
  EXPECT_FALSE(RawClient::meets_writer(others, std::chrono::seconds(0)));
}

// [host] read_variables and write_variables: which roles may is what the host's configuration says.
class RightsOfVariables : public SecuredHost {
 protected:
  void start_with(std::vector<std::string> rights) {
    std::vector<std::string> options{"--identity", folder("cell")};
    options.insert(options.end(), rights.begin(), rights.end());
    host_.start_server(std::move(options));
  }
  /// Its instance has no process that could tell values. A client that may ask is told so.
  void expect_read(const std::string& who, bool allowed, const std::string& needed) const {
    const auto read = run(who, {"list", "variables", "line1"});
    EXPECT_EQ(read.code, 1) << who;
    EXPECT_THAT(read.errors, allowed ? HasSubstr("declares no variables")
                                     : HasSubstr("this takes the role " + needed + " ([host] read_variables"))
        << who;
  }
  void expect_written(const std::string& who, bool allowed) {
    const std::size_t before = host_.requests().size();
    for (const char* const verb : {"write", "force"}) {
      const auto written = run(who, {verb, "variable", "line1", "Main.speed=5"});
      EXPECT_EQ(written.code, allowed ? 0 : 1) << who << written.errors;
      if (!allowed) {
        EXPECT_THAT(written.errors, HasSubstr("this takes the role engineer ([host] write_variables")) << who;
      }
    }
    const auto ended = run(who, {"unforce", "variable", "line1", "Main.speed"});
    EXPECT_EQ(ended.code, allowed ? 0 : 1) << who << ended.errors;
    EXPECT_THAT(host_.requests(), SizeIs(before + (allowed ? 3 : 0)));
  }
};

TEST_F(RightsOfVariables, AreThoseOfEngineersIfNothingIsSaid) {
  start_with({});
  expect_read("viewer", false, "engineer");
  expect_read("operator", false, "engineer");
  expect_read("engineer", true, "");
  expect_read("admin", true, "");
  expect_written("operator", false);
  expect_written("engineer", true);
}

TEST_F(RightsOfVariables, AreThoseOfViewersAndOperatorsIfTheHostSaysSo) {
  start_with({"--read-variables", "viewer", "--write-variables", "operator"});
  for (const char* const who : {"viewer", "operator", "engineer"}) expect_read(who, true, "");
  expect_written("operator", true);
  const auto written = run("viewer", {"write", "variable", "line1", "Main.speed=5"});
  EXPECT_EQ(written.code, 1);
  EXPECT_THAT(written.errors, HasSubstr("plc/v1/op/request: the permissions of this identity"));
}

TEST_F(RightsOfVariables, ToReadMayBeThatOfOperators) {
  start_with({"--read-variables", "operator"});
  expect_read("viewer", false, "operator");
  expect_read("operator", true, "");
}

// Permissions that say too much, as a mistake of their signer would be: the server looks at the role itself.
class PermissionsThatSayTooMuch : public SecuredHost {
 protected:
  PermissionsThatSayTooMuch() {
    const auto certificate = security::read_certificate(folder("viewer") + "/certificate.pem").value();
    const auto text = security::permissions_text(
        {.role = security::Role::admin, .name = "viewer"}, security::subject_text(certificate).value(),
        security::guid_prefix(certificate).value(), security::validity_of(certificate).value());
    const std::string authorities = plant_folder_ + "/authorities/";
    const security::Authority authority{
        security::read_certificate(authorities + "permissions_ca.pem").value(),
        security::read_key(authorities + "permissions_ca_key.pem").value()};
    std::ofstream(folder("viewer") + "/permissions.p7s") << security::sign_document(text, authority).value();
    start();
  }
};

TEST_F(PermissionsThatSayTooMuch, StillPostNothing) {
  const auto posted = run("viewer", {"post", "event", "line1/ready"});
  EXPECT_EQ(posted.code, 1);
  EXPECT_THAT(posted.errors, HasSubstr("'viewer' is viewer; this takes the role operator"));
  EXPECT_EQ(event_.counted().count(), 0U);
}

TEST_F(PermissionsThatSayTooMuch, StillCommandNothing) {
  const auto stopped = run("viewer", {"stop", "instance", "line1"});
  EXPECT_EQ(stopped.code, 1);
  EXPECT_THAT(stopped.errors, HasSubstr("'viewer' is viewer; this takes the role operator"));
  const auto read = run("viewer", {"logs", "line1"});
  EXPECT_EQ(read.code, 1);
  EXPECT_THAT(read.errors, HasSubstr("'viewer' is viewer; this takes the role operator"));
  const auto loaded = run("viewer", {"load", "application", "line1", "/tmp/other.so", "--on-host"});
  EXPECT_EQ(loaded.code, 1);
  EXPECT_THAT(loaded.errors, HasSubstr("this takes the role engineer"));
  EXPECT_THAT(host_.requests(), IsEmpty());
}

}  // namespace
}  // namespace plchost
