#include "api/dds/security_section.hpp"

#include <algorithm>
#include <filesystem>
#include <string_view>

#include <fmt/format.h>

#include "api/security/identity.hpp"
#include "api/security/xml_text.hpp"

namespace plchost::dds {

namespace {

// A plugin by its bare name: the system's, wherever its package has put it.
std::string library(std::string_view plugin, std::string_view functions) {
  return fmt::format(
      "<Library path=\"dds_security_{}\" initFunction=\"init_{}\" finalizeFunction=\"finalize_{}\"/>", plugin,
      functions, functions);
}

}  // namespace

Result<std::string> security_section(const std::string& folder) {
  if (folder.empty()) return "";
  std::error_code error;
  const std::string path = std::filesystem::absolute(folder, error).lexically_normal().string();
  // Cyclone expands variables in what it reads.
  const auto wrong = [](char c) { return c == '$' || static_cast<unsigned char>(c) < ' '; };
  if (error || std::ranges::any_of(path, wrong)) {
    return failure(ErrorCode::invalid_argument,
                   fmt::format("identity '{}': a path with '$' or a control character is not allowed",
                               folder.substr(0, 100)));
  }
  const auto file = [&](std::string_view element, std::string_view name) {
    return fmt::format("<{0}>file:{1}</{0}>", element, security::escaped(security::file_in(path, name)));
  };
  return fmt::format(
      "<Security><Authentication>{}{}{}{}{}</Authentication><AccessControl>{}{}{}{}</AccessControl>"
      "<Cryptographic>{}</Cryptographic></Security>",
      library("auth", "authentication"), file("IdentityCA", security::kIdentityAuthorityFile),
      file("IdentityCertificate", security::kCertificateFile), file("PrivateKey", security::kKeyFile),
      file("CRL", security::kRevocationsFile), library("ac", "access_control"),
      file("PermissionsCA", security::kPermissionsAuthorityFile),
      file("Governance", security::kGovernanceFile), file("Permissions", security::kPermissionsFile),
      library("crypto", "crypto"));
}

}  // namespace plchost::dds
