#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "api/security/certificates.hpp"

namespace plchost::security {

/// The identity behind each GUID: computed from the certificates of all identities that the folder of a host
/// knows. A participant cannot choose another prefix than that of the subject that its handshake has proved.
class KnownIdentities {
 public:
  /// Reads "folder/known". Revoked ones are left out; so are those not signed by the authority or
  /// expired, and told of in problems().
  [[nodiscard]] static Result<KnownIdentities> load(const std::string& folder);

  /// Of the participant, or of any entity of it, whose GUID begins so (at least 6 bytes). None: nobody that
  /// is known and whose certificate is valid now.
  [[nodiscard]] std::optional<Subject> find(std::span<const std::uint8_t> guid) const;

  [[nodiscard]] std::size_t size() const noexcept { return known_.size(); }
  [[nodiscard]] const std::vector<std::string>& problems() const noexcept { return problems_; }

  /// No folder holds more.
  static constexpr std::size_t kMost = 4096;

 private:
  struct Known {
    Subject subject;
    std::time_t not_after = 0;
  };
  std::map<GuidPrefix, Known> known_;
  std::vector<std::string> problems_;
};

}  // namespace plchost::security
