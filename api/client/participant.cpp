#include "api/client/participant.hpp"

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <unistd.h>

#include "api/dds/claim.hpp"

namespace plchost {

Result<std::shared_ptr<Participant>> enter_domain(const dds::DomainOptions& options) {
  PLCHOST_TRY_ASSIGN(auto domain, dds::open_domain(dds::Role::client, options));
  PLCHOST_TRY_ASSIGN(auto entity, dds::make_participant(options.domain, dds::client_participant_qos().get(),
                                                        fmt::format("enter DDS domain {}", options.domain)));
  return std::make_shared<Participant>(
      Participant{.domain = std::move(domain),
                  .entity = std::move(entity),
                  .only_loopback = options.interfaces == std::vector<std::string>{"lo"}});
}

Result<std::shared_ptr<ParticipantSource>> ParticipantSource::of_process(const dds::DomainOptions& options) {
  static std::mutex mutex;
  static std::map<std::pair<pid_t, std::uint32_t>, std::weak_ptr<ParticipantSource>> sources;
  const std::lock_guard lock(mutex);
  std::weak_ptr<ParticipantSource>& known = sources[{::getpid(), options.domain}];
  if (auto source = known.lock()) {
    if (source->options_ == options) return source;
    return failure(ErrorCode::invalid_argument,
                   fmt::format("this process is in DDS domain {} already, with another identity or other "
                               "interfaces or peers: a process has one participant of a domain",
                               options.domain));
  }
  auto made = std::make_shared<ParticipantSource>(options);
  known = made;
  return made;
}

Result<std::shared_ptr<Participant>> ParticipantSource::get() {
  const std::lock_guard lock(mutex_);
  if (auto known = made_.lock()) return known;
  auto entered = enter_domain(options_);
  if (entered) made_ = *entered;
  return entered;
}

}  // namespace plchost
