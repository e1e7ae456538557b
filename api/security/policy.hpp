#pragma once

#include <string>

#include "api/security/certificates.hpp"

namespace plchost::security {

/// The protection by DDS, for all domains: nobody unauthenticated, discovery and liveliness encrypted, every
/// message signed, the samples of all topics encrypted, each topic by permission only.
[[nodiscard]] std::string governance_text();

/// The topics and partitions that an identity of that role may write and read. A host: the partitions that
/// name it and no other host's. A client: replies and acknowledgements only in the partitions of its own
/// participants, which begin with its GUID prefix.
[[nodiscard]] std::string permissions_text(const Subject& subject, const std::string& subject_text,
                                           const GuidPrefix& prefix, const Validity& validity);

}  // namespace plchost::security
