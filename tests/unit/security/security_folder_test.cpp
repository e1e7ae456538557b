#include "api/security/security_folder.hpp"

#include <sys/stat.h>

#include "api/security/known_identities.hpp"
#include "api/security/pem.hpp"
#include "tests/unit/security/plant_folder.hpp"

namespace plchost::security {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

using TheSecurityFolder = PlantFolder;

TEST_F(TheSecurityFolder, IsMadeWithAHostWhoseIdentityIsAccepted) {
  const auto host = check_identity(folder("host"));
  ASSERT_TRUE(host) << host.error().describe();
  EXPECT_EQ(host->subject.role, Role::host);
  EXPECT_EQ(host->subject.name, "host");
}

TEST_F(TheSecurityFolder, IsNotMadeWhereSomethingIs) {
  const std::string before = contents(file("host", kCertificateFile));
  const auto made = SecurityFolder::init(plant, "host");
  ASSERT_FALSE(made);
  EXPECT_EQ(made.error().code, ErrorCode::already_exists);
  EXPECT_EQ(contents(file("host", kCertificateFile)), before);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(base), {}), 1) << "something is left beside it";
}

TEST_F(TheSecurityFolder, HasKeysThatOnlyTheirOwnerReads) {
  add(Role::viewer, "panel");
  for (const auto& entry : std::filesystem::recursive_directory_iterator(plant)) {
    struct stat status{};
    ASSERT_EQ(::stat(entry.path().c_str(), &status), 0);
    const bool is_key = entry.path().string().ends_with("key.pem");
    if (!is_key && !entry.is_directory()) continue;
    EXPECT_EQ(status.st_mode & 0777, is_key ? 0600U : 0700U) << entry.path();
  }
}

TEST_F(TheSecurityFolder, GivesEachRoleAnIdentityThatIsAccepted) {
  for (const Role role : {Role::viewer, Role::operating, Role::engineer, Role::admin, Role::host}) {
    const std::string name = fmt::format("a-{}", to_string(role));
    add(role, name);
    const auto identity = check_identity(folder(name));
    ASSERT_TRUE(identity) << identity.error().describe();
    EXPECT_EQ(identity->subject.role, role);
  }
  EXPECT_THAT(open().identities().value(), SizeIs(6));
}

TEST_F(TheSecurityFolder, RefusesANameThatIsTakenOrCannotBe) {
  add(Role::viewer, "anna");
  EXPECT_EQ(open().add(Role::admin, "anna").error().code, ErrorCode::already_exists);
  for (const std::string name : {"", "..", "a/b", "authorities", ".hidden", "a b"}) {
    EXPECT_EQ(open().add(Role::viewer, name).error().code, ErrorCode::invalid_argument) << name;
  }
  EXPECT_EQ(open().add(Role::viewer, "otto", 0).error().code, ErrorCode::invalid_argument);
}

TEST_F(TheSecurityFolder, SaysWhatThereIsWhereANameIsUnknown) {
  const auto revoked = open().revoke("ana");
  ASSERT_FALSE(revoked);
  EXPECT_EQ(revoked.error().code, ErrorCode::not_found);
  EXPECT_THAT(revoked.error().message, HasSubstr("there are: host"));
  EXPECT_EQ(SecurityFolder::open(base).error().code, ErrorCode::not_found);
}

TEST_F(TheSecurityFolder, ARevokedIdentityIsRefusedAndMayBeAddedAnew) {
  add(Role::operating, "anna");
  add(Role::viewer, "otto");
  ASSERT_TRUE(open().revoke("anna"));
  EXPECT_THAT(fault("anna"), HasSubstr("revoked"));
  EXPECT_THAT(fault("otto"), IsEmpty());
  EXPECT_EQ(open().revoke("anna").error().code, ErrorCode::wrong_state);
  EXPECT_EQ(open().renew("anna").error().code, ErrorCode::wrong_state);
  ASSERT_TRUE(open().add(Role::engineer, "anna"));
  EXPECT_THAT(fault("anna"), IsEmpty());
  ASSERT_TRUE(open().revoke("otto"));
  EXPECT_THAT(fault("otto"), HasSubstr("revoked"));
  EXPECT_THAT(fault("anna"), IsEmpty());
}

TEST_F(TheSecurityFolder, ARenewedIdentityHasAFreshKeyAndTheSameGuidPrefix) {
  add(Role::operating, "anna");
  const std::string key = contents(file("anna", kKeyFile));
  const auto prefix = guid_prefix(read_certificate(file("anna", kCertificateFile)).value()).value();
  ASSERT_TRUE(open().renew("anna", 100));
  EXPECT_THAT(fault("anna"), IsEmpty());
  EXPECT_NE(contents(file("anna", kKeyFile)), key);
  EXPECT_EQ(guid_prefix(read_certificate(file("anna", kCertificateFile)).value()).value(), prefix);
}

TEST_F(TheSecurityFolder, ARevokedNameTakesAllItsCertificatesWithItAlsoAfterItIsAddedAnew) {
  add(Role::operating, "anna");
  add(Role::operating, "otto");
  ASSERT_TRUE(open().renew("otto"));
  const auto keep = [&](const std::string& as) {
    std::filesystem::copy(folder("anna"), folder(as));
    return as;
  };
  std::vector<std::string> old{keep("first")};
  ASSERT_TRUE(open().renew("anna"));
  old.push_back(keep("second"));
  ASSERT_TRUE(open().renew("anna"));
  for (const std::string& each : old) EXPECT_THAT(fault(each), IsEmpty()) << "until the name is revoked";
  ASSERT_TRUE(open().revoke("anna"));
  ASSERT_TRUE(open().add(Role::viewer, "anna"));
  EXPECT_THAT(fault("anna"), IsEmpty());
  EXPECT_THAT(fault("otto"), IsEmpty());
  for (const std::string& each : old) {
    std::filesystem::copy_file(file("anna", kRevocationsFile), file(each, kRevocationsFile),
                               std::filesystem::copy_options::overwrite_existing);
    EXPECT_THAT(fault(each), HasSubstr("revoked")) << each;
  }
}

TEST_F(TheSecurityFolder, ARenewedIdentityKeepsTheOtherFilesOfItsFolder) {
  namespace fs = std::filesystem;
  add(Role::operating, "anna");
  write(file("host", "notes.txt"), "of the plant's administrator");
  fs::permissions(folder("host"), fs::perms(0750));
  ASSERT_TRUE(open().renew("host"));
  EXPECT_THAT(fault("host"), IsEmpty());
  EXPECT_EQ(contents(file("host", "notes.txt")), "of the plant's administrator");
  EXPECT_EQ(fs::status(folder("host")).permissions(), fs::perms(0750));
  EXPECT_TRUE(fs::exists(file("host", "known/anna.pem")));
  EXPECT_FALSE(fs::exists(folder(".host.new")));
}

// A revocation that was cut off would else say for ever that it is done.
TEST_F(TheSecurityFolder, IsBroughtUpToDateByTheNextCommandIfOneWasCutOff) {
  namespace fs = std::filesystem;
  add(Role::operating, "anna");
  add(Role::operating, "otto");
  const std::string before = contents(file("otto", kRevocationsFile));
  ASSERT_TRUE(open().revoke("anna"));
  const std::string after = contents(file("otto", kRevocationsFile));
  write(file("otto", kRevocationsFile), before);
  write(file("host", "known/otto.pem"), contents(file("anna", kCertificateFile)));
  fs::create_directory(folder(".otto.new"));
  EXPECT_EQ(open().revoke("anna").error().code, ErrorCode::wrong_state);
  EXPECT_EQ(contents(file("otto", kRevocationsFile)), after);
  EXPECT_EQ(contents(file("host", "known/otto.pem")), contents(file("otto", kCertificateFile)));
  EXPECT_FALSE(fs::exists(folder(".otto.new")));
}

TEST_F(TheSecurityFolder, AFileThatIsNoneMakesNobodyWait) {
  add(Role::operating, "anna");
  for (const std::string_view each : {kCertificateFile, kKeyFile, kRevocationsFile, kPermissionsFile}) {
    const std::string path = file("anna", each);
    const std::string before = contents(path);
    std::filesystem::remove(path);
    ASSERT_EQ(::mkfifo(path.c_str(), 0600), 0);
    EXPECT_THAT(fault("anna"), HasSubstr("is no regular file"));
    std::filesystem::remove(path);
    write(path, before);
    std::filesystem::permissions(path,
                                 std::filesystem::perms::owner_read | std::filesystem::perms::owner_write);
  }
  EXPECT_THAT(fault("anna"), IsEmpty());
}

TEST_F(TheSecurityFolder, AHostBeginsTheHandshakeWithEveryClient) {
  add(Role::host, "south");
  add(Role::admin, "anna");
  const auto prefix = [&](const std::string& name) {
    return guid_prefix(read_certificate(file(name, kCertificateFile)).value()).value();
  };
  EXPECT_LT(prefix("host"), prefix("anna"));
  EXPECT_LT(prefix("south"), prefix("anna"));
  EXPECT_NE(prefix("south"), prefix("host"));
}

TEST_F(TheSecurityFolder, HostsKnowWhoIsBehindAGuid) {
  add(Role::operating, "anna");
  add(Role::host, "south");
  const auto prefix = guid_prefix(read_certificate(file("anna", kCertificateFile)).value()).value();
  for (const std::string host : {"host", "south"}) {
    const auto known = KnownIdentities::load(folder(host));
    ASSERT_TRUE(known) << known.error().describe();
    EXPECT_THAT(known->problems(), IsEmpty());
    const auto found = known->find(prefix);
    ASSERT_TRUE(found);
    EXPECT_EQ(found->name, "anna");
    EXPECT_EQ(found->role, Role::operating);
    EXPECT_FALSE(known->find(GuidPrefix{1, 2, 3}));
  }
  ASSERT_TRUE(open().revoke("anna"));
  EXPECT_FALSE(KnownIdentities::load(folder("host"))->find(prefix));
}

TEST_F(TheSecurityFolder, AnIdentityIsKnownUntilItsCertificateEnds) {
  const std::time_t now = std::time(nullptr);
  ASSERT_TRUE(open().add_valid({.role = Role::viewer, .name = "brief"}, {now - 10, now + 2}));
  const auto prefix = guid_prefix(read_certificate(file("brief", kCertificateFile)).value()).value();
  const auto known = KnownIdentities::load(folder("host"));
  ASSERT_TRUE(known);
  EXPECT_EQ(known->size(), 2U);
  while (std::time(nullptr) <= now + 2) ::usleep(10'000);
  EXPECT_FALSE(known->find(prefix));
}

TEST_F(TheSecurityFolder, AStrangersCertificateIsNotKnown) {
  const std::string other = base + "/other";
  ASSERT_TRUE(SecurityFolder::init(other, "host"));
  ASSERT_TRUE(SecurityFolder::open(other)->add(Role::admin, "mallory"));
  std::filesystem::copy(other + "/mallory/certificate.pem", file("host", "known/mallory.pem"));
  write(file("host", "known/junk.pem"), "-----BEGIN CERTIFICATE-----\nAAAA\n-----END CERTIFICATE-----\n");
  const auto known = KnownIdentities::load(folder("host"));
  ASSERT_TRUE(known);
  EXPECT_EQ(known->size(), 1U);
  EXPECT_THAT(known->problems(), SizeIs(2));
}

}  // namespace
}  // namespace plchost::security
