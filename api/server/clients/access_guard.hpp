#pragma once

#include <mutex>
#include <optional>
#include <utility>

#include "api/dds/guid.hpp"
#include "api/security/known_identities.hpp"
#include "shm/base/result.hpp"

namespace plchost {

/// The writer of a sample, and its right to write it: the check behind that of DDS Security, which keeps a
/// sample from being written at all. It rests on the writer's GUID, which begins as the handshake has proved
/// (see KnownIdentities). Any thread.
class AccessGuard {
 public:
  /// Of an unsecured host: nobody is known, everybody may do all.
  AccessGuard() = default;
  explicit AccessGuard(security::KnownIdentities known) : known_(std::move(known)) {}

  /// The authenticated identity behind a writer, reader or participant. None: an unsecured host, or an
  /// identity that the host's folder does not know.
  [[nodiscard]] std::optional<security::Subject> identity_of(const dds::Guid& entity) const;

  /// refused: that entity's identity has not the role that it takes; the text is for the client.
  [[nodiscard]] Result<void> check(const dds::Guid& entity, security::Role needed) const;

  /// The present identities of the folder. Of a secured host.
  void replace(security::KnownIdentities known);

 private:
  mutable std::mutex mutex_;
  std::optional<security::KnownIdentities> known_;
};

}  // namespace plchost
