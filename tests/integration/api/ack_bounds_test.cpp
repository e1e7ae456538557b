// The bounds on instances of acknowledgement: one for each source of posts, and a client may make new sources
// without an end.
#include <algorithm>
#include <array>
#include <chrono>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "api/client/poster.hpp"
#include "api/dds/text.hpp"
#include "api/dds/topics.hpp"
#include "api/server/clients/ack_writers.hpp"
#include "tests/integration/api/readers_of.hpp"
#include "tests/integration/api/test_host.hpp"

namespace plchost {
namespace {

class AckBounds : public testing::Test {
 protected:
  AckBounds() {
    (void)host_.add_event("line1", "ready");
    host_.start_server();
  }

  OwnDomain domain_;
  TestHost host_{domain_, "hosta"};
};

/// A reader of what the host tells this participant of its posts.
dds::Entity read_acks(dds_entity_t subscriber, dds_entity_t topic) {
  return dds::make_reader(subscriber, topic, dds::qos_of(dds::kEventAck)).value();
}

/// As many as the clients take at a time: of a reader whose samples were on loan before, Cyclone fills an
/// array of that size again.
constexpr std::size_t kAtATime = 64;

/// The sources that the reader holds an acknowledgement of. Read with the same `Most` each time.
template <std::size_t Most = kAtATime>
std::vector<dds::Guid> sources_in(dds_entity_t reader) {
  std::vector<dds::Guid> sources;
  std::array<void*, Most> samples{};
  std::array<dds_sample_info_t, Most> infos{};
  const dds_return_t read = dds_read(reader, samples.data(), infos.data(), samples.size(), samples.size());
  for (std::size_t i = 0; i < static_cast<std::size_t>(std::max<dds_return_t>(read, 0)); ++i) {
    if (infos.at(i).valid_data)
      sources.push_back(dds::Guid::from(static_cast<const plc_EventAck*>(samples.at(i))->source));
  }
  if (read > 0) (void)dds_return_loan(reader, samples.data(), read);
  return sources;
}

bool has_source(const std::vector<dds::Guid>& sources, const dds::Guid& source) {
  return std::ranges::find(sources, source) != sources.end();
}

template <class Condition>
void wait_until_true(Condition condition) {
  for (const TimePoint end = soon(); !condition();) {
    ASSERT_LT(MonotonicClock::now(), end);
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

// The server keeps the latest one of each source for readers that come late.
TEST_F(AckBounds, AreSixtyFourSourcesOfAClientThatAServerKeeps) {
  const auto staying = connect(domain_);  // makes the domain
  const dds::Entity participant(dds_create_participant(domain_.number(), nullptr, nullptr));
  const auto events = dds::make_topic(participant.get(), dds::kEventPost).value();
  const auto acks = dds::make_topic(participant.get(), dds::kEventAck).value();
  const auto own = dds::make_subscriber(participant.get(),
                                        dds::client_partition(dds::guid_of(participant.get()).hex(), "hosta"))
                       .value();
  const dds::Entity reader = read_acks(own.get(), acks.get());

  constexpr std::size_t kIdentities = AckWriters::kMostSources + 36;
  constexpr std::size_t kMore = 2 * kIdentities;
  std::vector<EventPoster> posters;  // none ends meanwhile, which would take its acknowledgement along
  for (std::size_t i = 0; i < kIdentities; ++i) {
    posters.push_back(EventPoster::create(participant.get(), events.get(), "hosta").value());
    EventPoster& poster = posters.back();
    ASSERT_NO_FATAL_FAILURE(wait_until_true([&] { return poster.matched(); }));
    (void)poster.post(EventId{"line1", "ready"}, MonotonicClock::now());
    ASSERT_NO_FATAL_FAILURE(wait_until_true([&] {
      (void)poster.repeat(MonotonicClock::now());
      return has_source(sources_in<kMore>(reader.get()), poster.source());
    }));
  }

  // A source that has gone is told to nobody once the reader of before has acknowledged that.
  std::vector<dds::Guid> kept;
  ASSERT_NO_FATAL_FAILURE(wait_until_true([&] {
    const dds::Entity late = read_acks(own.get(), acks.get());
    wait_until_true([&] { return has_source(sources_in<kMore>(late.get()), posters.back().source()); });
    kept = sources_in<kMore>(late.get());
    return kept.size() == AckWriters::kMostSources;
  }));
  EXPECT_FALSE(has_source(kept, posters.front().source())) << "the first that posted, which went";
}

// All clients of a process are told of the posts of each.
TEST_F(AckBounds, AreNoneOfOthersInAClient) {
  const auto sut = connect(domain_);
  const auto post = [](ControlClient& client) {
    const auto posted = client.post_event({"hosta", "line1", "ready"}, 1, {}, kPatience);
    ASSERT_TRUE(posted) << posted.error().describe();
  };
  post(*sut);
  constexpr int kIdentities = 40;
  for (int i = 0; i < kIdentities; ++i) post(*ControlClient::connect(sut->participant()).value());

  std::size_t readers = 0;
  for (const dds_entity_t reader : readers_of<plc_EventAck>(*sut)) {
    ++readers;
    EXPECT_LE(sources_in(reader).size(), 1U) << "its own";
  }
  EXPECT_EQ(readers, 1U) << "those of the others have ended";
  post(*sut);
}

}  // namespace
}  // namespace plchost
