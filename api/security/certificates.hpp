#pragma once

#include <array>
#include <cstdint>
#include <ctime>
#include <optional>
#include <span>
#include <string>

#include "api/security/openssl.hpp"
#include "api/security/role.hpp"

namespace plchost::security {

/// Seconds of the Unix clock, both inclusive.
struct Validity {
  std::time_t not_before = 0;
  std::time_t not_after = 0;
};

/// The holder of a certificate. In it: O=plchost, OU=<role>, CN=<name>, and for hosts a serialNumber.
struct Subject {
  Role role = Role::viewer;
  std::string name;
};

/// A certificate authority, which signs.
struct Authority {
  Certificate certificate;
  Key key;
};

/// The first 6 bytes of the GUIDs of all participants of a subject: bit 1, then the first 47 bits of the
/// SHA-256 of the subject's DER form. So DDS Security has it; the handshake checks it.
using GuidPrefix = std::array<std::uint8_t, 6>;

/// Names of identities, in bytes: as long as a common name may be.
inline constexpr std::size_t kMaxIdentityName = 63;

/// On the curve P-256, which all plugins of DDS Security know.
[[nodiscard]] Result<Key> make_key();

/// A fresh, self-signed authority.
[[nodiscard]] Result<Authority> make_authority(const std::string& name, const Validity& validity);

/// A certificate for that key. That of a host has a subject whose GUID prefix is lower than any client's: so
/// it is the host that begins the handshake, which Fast DDS 2.9 needs.
[[nodiscard]] Result<Certificate> issue_certificate(const Subject& subject, const Validity& validity,
                                                    const Key& key, const Authority& authority);

/// corrupt: not a subject as issue_certificate() writes it.
[[nodiscard]] Result<Subject> subject_of(const Certificate& certificate);
[[nodiscard]] Result<Validity> validity_of(const Certificate& certificate);
/// As permissions documents want it (RFC 2253).
[[nodiscard]] Result<std::string> subject_text(const Certificate& certificate);
[[nodiscard]] Result<GuidPrefix> guid_prefix(const Certificate& certificate);

/// The serial number, in hexadecimal digits.
[[nodiscard]] Result<std::string> serial_text(const Certificate& certificate);

/// The same list with more certificates, each once; a fresh one if `known` is null.
[[nodiscard]] Result<RevocationList> make_revocations(const RevocationList& known,
                                                      std::span<const Certificate> added,
                                                      const Validity& validity, const Authority& authority);
[[nodiscard]] bool is_revoked(const Certificate& certificate, const RevocationList& revocations);

/// refused: not signed by that authority, not valid at this time, or revoked; the text says which.
[[nodiscard]] Result<void> verify_certificate(const Certificate& certificate, const Certificate& authority,
                                              const RevocationList& revocations);
/// corrupt: not that authority's.
[[nodiscard]] Result<void> verify_revocations(const RevocationList& revocations,
                                              const Certificate& authority);

}  // namespace plchost::security
