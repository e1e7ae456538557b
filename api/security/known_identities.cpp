#include "api/security/known_identities.hpp"

#include <algorithm>
#include <filesystem>

#include <fmt/format.h>

#include "api/security/identity.hpp"
#include "api/security/pem.hpp"

namespace plchost::security {

namespace {

struct Certified {
  GuidPrefix prefix;
  Subject subject;
  Validity validity;
};

/// None: revoked, as it may well be.
Result<std::optional<Certified>> read_known(const std::string& path, const Certificate& authority,
                                            const RevocationList& revocations) {
  PLCHOST_TRY_ASSIGN(const auto certificate, read_certificate(path));
  if (is_revoked(certificate, revocations)) return std::nullopt;
  PLCHOST_TRY(in_step(path, verify_certificate(certificate, authority, revocations)));
  PLCHOST_TRY_ASSIGN(auto subject, in_step(path, subject_of(certificate)));
  PLCHOST_TRY_ASSIGN(const auto prefix, in_step(path, guid_prefix(certificate)));
  PLCHOST_TRY_ASSIGN(const auto validity, in_step(path, validity_of(certificate)));
  return std::optional(Certified{prefix, std::move(subject), validity});
}

}  // namespace

Result<KnownIdentities> KnownIdentities::load(const std::string& folder) {
  PLCHOST_TRY_ASSIGN(const auto authority, read_certificate(file_in(folder, kIdentityAuthorityFile)));
  PLCHOST_TRY_ASSIGN(const auto revocations, read_revocations(file_in(folder, kRevocationsFile)));
  const std::string known = file_in(folder, kKnownFolder);
  KnownIdentities identities;
  std::error_code error;
  auto entry = std::filesystem::directory_iterator(known, error);
  for (; !error && entry != std::filesystem::directory_iterator(); entry.increment(error)) {
    if (entry->path().extension() != ".pem") continue;
    if (identities.size() >= kMost) {
      return failure(ErrorCode::full, fmt::format("{} holds more than {} certificates", known, kMost));
    }
    auto one = read_known(entry->path(), authority, revocations);
    if (!one) {
      identities.problems_.push_back(one.error().describe());
      continue;
    }
    if (!*one) continue;
    Known of_one{.subject = std::move((*one)->subject), .not_after = (*one)->validity.not_after};
    if (!identities.known_.emplace((*one)->prefix, std::move(of_one)).second) {
      identities.problems_.push_back(
          fmt::format("{}: an identity with the same GUID prefix is known", entry->path().string()));
    }
  }
  if (error) {
    return failure(ErrorCode::system, fmt::format("cannot read {}: only the folder of a host has it", known),
                   error.value());
  }
  return identities;
}

std::optional<Subject> KnownIdentities::find(std::span<const std::uint8_t> guid) const {
  GuidPrefix prefix{};
  if (guid.size() < prefix.size()) return std::nullopt;
  std::ranges::copy(guid.first(prefix.size()), prefix.begin());
  const auto found = known_.find(prefix);
  if (found == known_.end() || found->second.not_after < std::time(nullptr)) return std::nullopt;
  return found->second.subject;
}

}  // namespace plchost::security
