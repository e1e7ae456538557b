#include "api/security/identity.hpp"

#include "api/security/pem.hpp"
#include "api/security/signed_document.hpp"
#include "tests/unit/security/plant_folder.hpp"

namespace plchost::security {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

class AnIdentity : public PlantFolder {
 protected:
  void SetUp() override {
    PlantFolder::SetUp();
    add(Role::operating, "anna");
    add(Role::admin, "otto");
  }
  void take_from(const std::string& other, std::string_view what) const {
    std::filesystem::copy_file(file(other, what), file("anna", what),
                               std::filesystem::copy_options::overwrite_existing);
  }
};

TEST_F(AnIdentity, CanBeCopiedElsewhere) {
  std::filesystem::copy(folder("anna"), base + "/elsewhere");
  std::filesystem::remove_all(plant);
  const auto identity = check_identity(base + "/elsewhere");
  ASSERT_TRUE(identity) << identity.error().describe();
  EXPECT_EQ(identity->subject.name, "anna");
}

TEST_F(AnIdentity, WithThePermissionsOfAnotherIsRefused) {
  take_from("otto", kPermissionsFile);
  EXPECT_THAT(fault("anna"), HasSubstr("permissions of another identity than 'CN=anna"));
}

TEST_F(AnIdentity, WithTheKeyOfAnotherIsRefused) {
  take_from("otto", kKeyFile);
  EXPECT_THAT(fault("anna"), HasSubstr("key.pem is not the key of certificate.pem"));
}

TEST_F(AnIdentity, WithAKeyThatOthersReadIsRefused) {
  std::filesystem::permissions(file("anna", kKeyFile), std::filesystem::perms(0640));
  EXPECT_THAT(fault("anna"), HasSubstr("chmod 600"));
}

TEST_F(AnIdentity, WithAlteredPermissionsIsRefused) {
  std::string text = contents(file("anna", kPermissionsFile));
  const auto at = text.find("plc/v1/op/request");
  ASSERT_NE(at, std::string::npos);
  text.replace(at, 17, "plc/v1/**/request");
  write(file("anna", kPermissionsFile), text);
  EXPECT_THAT(fault("anna"), HasSubstr("permissions.p7s is not as the permissions authority signed it"));
}

TEST_F(AnIdentity, OfAnotherPlantIsRefused) {
  const std::string other = base + "/other";
  ASSERT_TRUE(SecurityFolder::init(other, "host"));
  for (const std::string_view ca : {kIdentityAuthorityFile, kRevocationsFile}) {
    std::filesystem::copy_file(file_in(other + "/host", ca), file("anna", ca),
                               std::filesystem::copy_options::overwrite_existing);
  }
  EXPECT_THAT(fault("anna"), HasSubstr("the certificate of 'CN=anna,OU=operator,O=plchost' is not accepted"));
}

TEST_F(AnIdentity, ThatHasEndedOrNotBegunIsRefused) {
  const std::time_t now = std::time(nullptr);
  ASSERT_TRUE(open().add_valid({.role = Role::viewer, .name = "past"}, {now - 100, now - 10}));
  ASSERT_TRUE(open().add_valid({.role = Role::viewer, .name = "future"}, {now + 1000, now + 2000}));
  EXPECT_THAT(fault("past"), HasSubstr("expired"));
  EXPECT_THAT(fault("future"), HasSubstr("not yet valid"));
}

TEST_F(AnIdentity, ThatLacksAFileOrHasJunkInItNamesTheFile) {
  for (const std::string_view part : {kIdentityAuthorityFile, kPermissionsAuthorityFile, kGovernanceFile,
                                      kPermissionsFile, kCertificateFile, kKeyFile, kRevocationsFile}) {
    const std::string path = file("anna", part);
    const std::string good = contents(path);
    for (const std::string& bad : {std::string(), std::string("junk"), good.substr(0, good.size() / 2),
                                   std::string(kMaxSecurityFile + 1, 'A')}) {
      write(path, bad);
      EXPECT_THAT(fault("anna"), HasSubstr(part));
    }
    std::filesystem::remove(path);
    EXPECT_THAT(fault("anna"), HasSubstr(part));
    write(path, good);
    std::filesystem::permissions(path, std::filesystem::perms(0600));
    EXPECT_THAT(fault("anna"), IsEmpty()) << part;
  }
  EXPECT_THAT(fault("nobody"), HasSubstr("is no folder of an identity"));
}

TEST(ASignedDocument, IsOpenedWithItsAuthorityOnly) {
  const auto one = make_authority("one", validity_for(1)).value();
  const auto other = make_authority("other", validity_for(1)).value();
  const std::string document = sign_document("line one\nline two\n", one).value();
  EXPECT_THAT(document, HasSubstr("multipart/signed"));
  const auto text = open_document("it", document, one.certificate);
  ASSERT_TRUE(text) << text.error().describe();
  EXPECT_THAT(*text, HasSubstr("line two"));
  EXPECT_EQ(open_document("it", document, other.certificate).error().code, ErrorCode::refused);
}

TEST(ARole, IncludesTheClientsRolesBeforeItAndNoHostIsOne) {
  EXPECT_TRUE(includes(Role::admin, Role::engineer));
  EXPECT_TRUE(includes(Role::operating, Role::operating));
  EXPECT_FALSE(includes(Role::viewer, Role::operating));
  EXPECT_FALSE(includes(Role::host, Role::viewer));
  EXPECT_FALSE(includes(Role::admin, Role::host));
}

TEST(ARole, ThatIsUnknownIsToldWithTheKnownOnes) {
  const auto role = parse_role("operater");
  ASSERT_FALSE(role);
  EXPECT_THAT(role.error().message,
              HasSubstr("did you mean 'operator'?); there are: viewer, operator, engineer, admin, host"));
}

}  // namespace
}  // namespace plchost::security
