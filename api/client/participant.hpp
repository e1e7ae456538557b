#pragma once

#include <memory>
#include <mutex>
#include <utility>

#include "api/dds/domain.hpp"
#include "api/dds/entity.hpp"
#include "shm/base/result.hpp"

namespace plchost {

/// A participant of a DDS domain. A process needs one: all of its ControlClients can share it, each on a
/// thread of its own. Others get to know every participant, and a secured one costs a handshake with each
/// host.
struct Participant {
  std::shared_ptr<dds::Entity> domain;
  dds::Entity entity;
  bool only_loopback = true;
};

[[nodiscard]] Result<std::shared_ptr<Participant>> enter_domain(const dds::DomainOptions& options);

/// One participant for several threads: made when it is first wanted, and again as long as that fails. It
/// ends with the last ControlClient that has it. Thread-safe.
class ParticipantSource {
 public:
  explicit ParticipantSource(dds::DomainOptions options) : options_(std::move(options)) {}
  /// The one of this process for that domain; it ends with its last user. invalid_argument: there is one with
  /// other options. A child of fork() has none of its parent's.
  [[nodiscard]] static Result<std::shared_ptr<ParticipantSource>> of_process(
      const dds::DomainOptions& options);
  [[nodiscard]] Result<std::shared_ptr<Participant>> get();

 private:
  dds::DomainOptions options_;
  std::mutex mutex_;
  std::weak_ptr<Participant> made_;
};

}  // namespace plchost
