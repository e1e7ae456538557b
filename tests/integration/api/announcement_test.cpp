// To which addresses a server announces itself.
#include <chrono>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "api/dds/announcements.hpp"
#include "api/dds/domain.hpp"
#include "api/dds/samples.hpp"
#include "tests/integration/api/test_host.hpp"

namespace plchost {
namespace {

using std::chrono::milliseconds;

class AnnouncedAddresses : public testing::Test {
 protected:
  AnnouncedAddresses() {
    dds::DomainOptions options;
    options.domain = own_.number();
    domain_ = dds::open_domain(dds::Role::server, options).value();
    participant_ = dds::Entity(dds_create_participant(options.domain, nullptr, nullptr));
    sut_ = dds::Announcements(participant_.get());
    configured_ = count();
    others_ = dds::Entity(
        dds_create_reader(participant_.get(), DDS_BUILTIN_TOPIC_DCPSPARTICIPANT, nullptr, nullptr));
  }

  [[nodiscard]] std::size_t count() const { return plc_announced_addresses(participant_.get(), nullptr, 0); }
  std::vector<dds::Guid> there() {
    dds::take_all<dds_builtintopic_participant_t>(others_.get(),
                                                  [&](const auto& participant, const auto& info) {
                                                    const auto guid = dds::Guid::from(participant.key.v);
                                                    std::erase(there_, guid);
                                                    if (info.instance_state == DDS_IST_ALIVE)
                                                      there_.push_back(guid);
                                                  });
    return there_;
  }
  /// Itself, and so many.
  bool are_there(std::size_t clients) {
    const TimePoint end = soon();
    while (there().size() != clients + 1 && MonotonicClock::now() < end) {
      std::this_thread::sleep_for(milliseconds(5));
    }
    return there().size() == clients + 1;
  }
  [[nodiscard]] Child make_client() const {
    return {PLCCTL_PROGRAM, {"--domain", std::to_string(own_.number()), "--timeout", "60", "list", "hosts"}};
  }

  OwnDomain own_;
  std::shared_ptr<dds::Entity> domain_;
  dds::Entity participant_;
  dds::Entity others_;
  dds::Announcements sut_;
  std::size_t configured_ = 0;
  std::vector<dds::Guid> there_;
};

TEST_F(AnnouncedAddresses, AreThoseOfClientsThatAreThere) {
  constexpr std::size_t kClients = 6;
  const Child staying = make_client();
  ASSERT_TRUE(are_there(1));
  {
    std::vector<Child> clients;
    for (std::size_t i = 0; i < kClients; ++i) clients.push_back(make_client());
    ASSERT_TRUE(are_there(1 + kClients));
    EXPECT_EQ(sut_.forget_gone(there()), 0U);
    EXPECT_EQ(sut_.forget_gone(there()), 0U) << "all are there";
  }
  EXPECT_EQ(count(), configured_ + 1 + kClients);
  ASSERT_TRUE(are_there(1));
  EXPECT_EQ(sut_.forget_gone(there()), 0U) << "one that is coming may not be among those that are there";
  EXPECT_EQ(sut_.forget_gone(there()), kClients);
  EXPECT_EQ(count(), configured_ + 1);

  const Child another = make_client();
  ASSERT_TRUE(are_there(2));
  EXPECT_EQ(count(), configured_ + 2);
}

TEST_F(AnnouncedAddresses, ComeBackWithAClientThatWasOverlooked) {
  const Child client = make_client();
  ASSERT_TRUE(are_there(1));
  EXPECT_EQ(sut_.forget_gone({}), 0U);
  EXPECT_EQ(sut_.forget_gone({}), 1U) << "as when it has come again, and its discovery was not looked at";
  ASSERT_EQ(count(), configured_);
  EXPECT_EQ(sut_.forget_gone(there()), 0U);
  EXPECT_EQ(count(), configured_ + 1)
      << "Cyclone knows the client, and would not announce the host to it again";
}

}  // namespace
}  // namespace plchost
