#pragma once

#include <memory>
#include <string>
#include <vector>

#include <gmock/gmock.h>

#include "api/client/control_client.hpp"
#include "api/dds/domain.hpp"
#include "api/dds/topics.hpp"
#include "api/security/identity.hpp"
#include "api/security/security_folder.hpp"
#include "tests/integration/api/test_host.hpp"

namespace plchost {

/// A plant with an identity of each role, called as the role, and a secured host in it with one instance and
/// one event.
class SecuredHost : public testing::Test {
 protected:
  SecuredHost();
  ~SecuredHost() override;

  [[nodiscard]] security::SecurityFolder plant() const {
    return security::SecurityFolder::open(plant_folder_).value();
  }
  [[nodiscard]] std::string folder(const std::string& identity) const {
    return plant_folder_ + "/" + identity;
  }
  void start() { host_.start_server({"--identity", folder("cell")}); }
  /// As the operator.
  [[nodiscard]] std::unique_ptr<ControlClient> make_client() const {
    dds::DomainOptions options;
    options.domain = domain_.number();
    options.identity = folder("operator");
    return ControlClient::connect(options).value();
  }
  /// Whether the host acknowledges a post of that client in time.
  [[nodiscard]] static testing::AssertionResult can_post(ControlClient& client, Duration patience);
  /// plcctl with an identity; empty: with none.
  [[nodiscard]] RunResult run(const std::string& identity, std::vector<std::string> arguments) const {
    return run_with_folder(identity.empty() ? "" : folder(identity), std::move(arguments));
  }
  [[nodiscard]] RunResult run_with_folder(const std::string& identity_folder,
                                          std::vector<std::string> arguments) const;
  /// Whether plcctl sees the host within some seconds.
  [[nodiscard]] bool sees_host(const std::string& identity_folder, const char* seconds = "60") const;

  OwnDomain domain_;
  std::string base_;
  std::string plant_folder_;
  TestHost host_{domain_, "cell"};
  PoolEvent event_;
};

/// A participant that keeps to no rule of ours: it writes and reads what DDS lets it.
class RawClient {
 public:
  /// `patched`: with an access control plugin that allows its own process everything. `role`: clients and
  /// servers see each other, clients do not see clients.
  RawClient(const OwnDomain& domain, const std::string& identity_folder, bool patched = false,
            dds::Role role = dds::Role::client);
  RawClient(const RawClient&) = delete;
  RawClient& operator=(const RawClient&) = delete;

  /// False: DDS refused it.
  [[nodiscard]] bool is_in_domain() const { return static_cast<bool>(participant_); }
  [[nodiscard]] dds_entity_t participant() const { return participant_.get(); }
  [[nodiscard]] dds::Guid guid() const { return dds::guid_of(participant_.get()); }
  /// A writer or reader in that partition. 0: DDS refused it.
  dds_entity_t write(const dds::TopicInfo& topic, const std::string& partition,
                     const dds::Qos& qos = dds::qos_of(dds::kOperatorRequest));
  dds_entity_t read(const dds::TopicInfo& topic, const std::string& partition,
                    const dds::Qos& qos = dds::qos_of(dds::kReply));

  /// Whether it meets its other end within that time.
  static bool meets_reader(dds_entity_t writer, Duration within = kPatience);
  static bool meets_writer(dds_entity_t reader, Duration within = kPatience);

 private:
  dds_entity_t keep(Result<dds::Entity> made);

  dds::Entity domain_;
  dds::Entity participant_;
  std::vector<dds::Entity> entities_;
};

}  // namespace plchost
