#include "api/security/security_folder.hpp"

#include <cstdint>

#include <sys/stat.h>
#include <sys/xattr.h>

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

// setfacl(1): entries of the owner, a user, the group, the mask and others, each with tag, rights and id.
std::string access_list(std::uint32_t user, std::uint16_t rights) {
  std::string list;
  const auto put = [&](auto value) { list.append(reinterpret_cast<const char*>(&value), sizeof value); };
  const auto entry = [&](std::uint16_t tag, std::uint16_t allowed, std::uint32_t id) {
    put(tag);
    put(allowed);
    put(id);
  };
  constexpr std::uint32_t kNobody = 0xffff'ffff;
  put(std::uint32_t{2});  // the version
  entry(0x01, 7, kNobody);
  entry(0x02, rights, user);
  entry(0x04, 0, kNobody);
  entry(0x10, rights, kNobody);
  entry(0x20, 0, kNobody);
  return list;
}

constexpr const char* kAccess = "system.posix_acl_access";
constexpr const char* kDefault = "system.posix_acl_default";

std::string attribute(const std::string& path, const char* name) {
  std::string value(256, '\0');
  const auto size = ::getxattr(path.c_str(), name, value.data(), value.size());
  value.resize(size < 0 ? 0 : static_cast<std::size_t>(size));
  return value;
}

bool give(const std::string& path, const char* name, const std::string& value) {
  return ::setxattr(path.c_str(), name, value.data(), value.size(), 0) == 0;
}

TEST_F(TheSecurityFolder, ARenewedIdentityKeepsTheAccessListsOfItsFolders) {
  const std::string of_host = access_list(12'345, 5);
  const std::string inherited = access_list(12'346, 7);
  if (!give(folder("host"), kAccess, of_host)) GTEST_SKIP() << "needs a file system with access lists";
  ASSERT_TRUE(give(file("host", "known"), kDefault, of_host));
  ASSERT_TRUE(give(plant, kDefault, inherited));
  ASSERT_TRUE(open().renew("host"));
  EXPECT_EQ(attribute(folder("host"), kAccess), of_host);
  EXPECT_EQ(attribute(folder("host"), kDefault), "") << "it had none";
  EXPECT_EQ(attribute(file("host", "known"), kAccess), "");
  EXPECT_EQ(attribute(file("host", "known"), kDefault), of_host);
  EXPECT_EQ(std::filesystem::status(file("host", "known")).permissions(), std::filesystem::perms(0700));
}

TEST_F(TheSecurityFolder, DoesNotReplaceALinkToAFolder) {
  namespace fs = std::filesystem;
  add(Role::operating, "anna");
  const std::string elsewhere = base + "/elsewhere";
  fs::rename(folder("anna"), elsewhere);
  fs::create_directory_symlink(elsewhere, folder("anna"));
  const std::string key = contents(file("anna", kKeyFile));
  const auto refused = [&](const Result<void>& done) {
    ASSERT_FALSE(done);
    EXPECT_EQ(done.error().code, ErrorCode::wrong_state);
    EXPECT_THAT(done.error().message, HasSubstr(folder("anna") + " is a symbolic link"));
    EXPECT_TRUE(fs::is_symlink(folder("anna")));
    EXPECT_EQ(contents(file("anna", kKeyFile)), key);
    EXPECT_FALSE(fs::exists(folder(".anna.new")));
  };
  refused(open().renew("anna"));
  ASSERT_TRUE(open().revoke("anna"));
  EXPECT_THAT(fault("anna"), HasSubstr("revoked")) << "also behind the link";
  refused(open().add(Role::viewer, "anna"));
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

// As a file without write permission, but for root, too: a folder stands where the fresh file is written.
TEST_F(TheSecurityFolder, RevokesInAllOtherFoldersIfOneCannotBeWritten) {
  for (const std::string name : {"anna", "otto", "zoe"}) add(Role::operating, name);
  const std::string in_the_way = file("anna", kRevocationsFile) + ".new";
  std::filesystem::create_directory(in_the_way);
  for (const std::string name : {"otto", "zoe"}) {
    const auto revoked = open().revoke(name);
    ASSERT_FALSE(revoked);
    EXPECT_THAT(revoked.error().describe(), HasSubstr("'" + name + "' is revoked, but not in all folders"));
    EXPECT_THAT(revoked.error().describe(), HasSubstr(in_the_way));
    EXPECT_THAT(fault(name), HasSubstr("revoked"));
  }
  EXPECT_EQ(contents(file("host", kRevocationsFile)), contents(file("authorities", kRevocationsFile)));
  const auto again = open().revoke("zoe");
  ASSERT_FALSE(again);
  EXPECT_THAT(again.error().describe(), HasSubstr(in_the_way)) << "as long as it is not done everywhere";
  std::filesystem::remove(in_the_way);
  EXPECT_EQ(open().revoke("zoe").error().code, ErrorCode::wrong_state);
  EXPECT_EQ(contents(file("anna", kRevocationsFile)), contents(file("authorities", kRevocationsFile)));
}

TEST_F(TheSecurityFolder, TellsAllOtherHostsOfAnIdentityIfOneCannotBeWritten) {
  add(Role::host, "north");
  add(Role::host, "south");
  for (const std::string name : {"host", "north"}) write(file(name, "known/south.pem"), "before");
  const std::string in_the_way = file("host", "known/south.pem.new");
  std::filesystem::create_directory(in_the_way);
  EXPECT_THAT(open().add(Role::viewer, "anna").error().describe(), HasSubstr(in_the_way));
  EXPECT_EQ(contents(file("north", "known/south.pem")), contents(file("south", kCertificateFile)));
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
