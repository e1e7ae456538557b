#include "api/client/participant.hpp"

#include <string>
#include <vector>

#include <fmt/format.h>

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

Result<std::shared_ptr<Participant>> ParticipantSource::get() {
  const std::lock_guard lock(mutex_);
  if (auto known = made_.lock()) return known;
  auto entered = enter_domain(options_);
  if (entered) made_ = *entered;
  return entered;
}

}  // namespace plchost
