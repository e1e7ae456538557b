#pragma once

#include <string>

#include "api/security/certificates.hpp"

namespace plchost::security {

/// What DDS has to protect and how, for all domains: nobody unauthenticated, discovery and liveliness
/// encrypted, every message signed, the samples of all topics encrypted, each topic by permission only.
[[nodiscard]] std::string governance_text();

/// What an identity of that role may write and read, by topic and partition: a host in the partitions that
/// name it and in no other host's; a client replies and acknowledgements only in the partitions of its own
/// participants, which begin with its GUID prefix.
[[nodiscard]] std::string permissions_text(const Subject& subject, const std::string& subject_text,
                                           const GuidPrefix& prefix, const Validity& validity);

}  // namespace plchost::security
