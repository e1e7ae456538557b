#include "tests/integration/security/secured_host.hpp"

#include <filesystem>
#include <thread>

#include <unistd.h>

#include "tests/support/own_name.hpp"

namespace plchost {

namespace {

using security::Role;

template <class Condition>
bool comes_true(Duration within, Condition condition) {
  const TimePoint end = MonotonicClock::now() + within;
  while (!condition()) {
    if (MonotonicClock::now() >= end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return true;
}

}  // namespace

SecuredHost::SecuredHost() : base_(own_path("secured")), plant_folder_(base_ + "/plant") {
  std::filesystem::remove_all(base_);
  std::filesystem::create_directory(base_);
  EXPECT_TRUE(security::SecurityFolder::init(plant_folder_, "cell"));
  for (const Role role : {Role::viewer, Role::operating, Role::engineer, Role::admin}) {
    EXPECT_TRUE(plant().add(role, std::string(to_string(role))));
  }
  host_.write_instance(0, "line1", InstanceState::running, 4711);
  host_.write_count(1);
  event_ = host_.add_event("line1", "ready");
  event_.set_bound_tasks(1);
}

SecuredHost::~SecuredHost() {
  std::filesystem::remove_all(base_);
}

testing::AssertionResult SecuredHost::can_post(ControlClient& client, Duration patience) {
  const auto posted = client.post_event({"cell", "line1", "ready"}, 1, {}, patience);
  if (!posted) return testing::AssertionFailure() << posted.error().describe();
  if (posted->unacknowledged == 0) return testing::AssertionSuccess();
  return testing::AssertionFailure() << "the host has not acknowledged the post";
}

RunResult SecuredHost::run_with_folder(const std::string& identity_folder,
                                       std::vector<std::string> arguments) const {
  if (!identity_folder.empty()) arguments.insert(arguments.begin(), {"--identity", identity_folder});
  return run_plcctl(domain_.number(), std::move(arguments));
}

bool SecuredHost::sees_host(const std::string& identity_folder, const char* seconds) const {
  const auto seen = run_with_folder(identity_folder, {"--timeout", seconds, "list", "hosts"});
  return seen.code == 0 && seen.output.find("cell") != std::string::npos;
}

RawClient::RawClient(const OwnDomain& domain, const std::string& identity_folder, bool patched,
                     dds::Role role) {
  dds::DomainOptions options;
  options.domain = domain.number();
  options.identity = identity_folder;
  std::string configuration = dds::domain_configuration(role, options).value();
  if (patched) {
    const std::string plugin = "path=\"dds_security_ac\"";
    const auto at = configuration.find(plugin);
    EXPECT_NE(at, std::string::npos);
    configuration.replace(at, plugin.size(), "path=\"" PATCHED_ACCESS_CONTROL "\"");
  }
  domain_ = dds::Entity(dds_create_domain(options.domain, configuration.c_str()));
  participant_ = dds::Entity(dds_create_participant(options.domain, nullptr, nullptr));
}

dds_entity_t RawClient::keep(Result<dds::Entity> made) {
  if (!made) return 0;
  entities_.push_back(std::move(*made));
  return entities_.back().get();
}

dds_entity_t RawClient::write(const dds::TopicInfo& topic, const std::string& partition,
                              const dds::Qos& qos) {
  const dds_entity_t made = keep(dds::make_topic(participant(), topic));
  if (made == 0) return 0;
  return keep(dds::make_writer(keep(dds::make_publisher(participant(), partition)), made, qos));
}

dds_entity_t RawClient::read(const dds::TopicInfo& topic, const std::string& partition, const dds::Qos& qos) {
  const dds_entity_t made = keep(dds::make_topic(participant(), topic));
  if (made == 0) return 0;
  return keep(dds::make_reader(keep(dds::make_subscriber(participant(), partition)), made, qos));
}

bool RawClient::meets_reader(dds_entity_t writer, Duration within) {
  return comes_true(within, [&] {
    dds_publication_matched_status_t status{};
    return dds_get_publication_matched_status(writer, &status) == DDS_RETCODE_OK && status.current_count > 0;
  });
}

bool RawClient::meets_writer(dds_entity_t reader, Duration within) {
  return comes_true(within, [&] {
    dds_subscription_matched_status_t status{};
    return dds_get_subscription_matched_status(reader, &status) == DDS_RETCODE_OK && status.current_count > 0;
  });
}

}  // namespace plchost
