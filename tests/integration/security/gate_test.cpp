// Cyclone survives all that the gate of an unsecured host passes.
#include <algorithm>
#include <array>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <thread>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/integration/api/test_host.hpp"
#include "tests/integration/security/cyclone_oracle.hpp"

namespace plchost {
namespace {

std::uint64_t number_from(const char* variable, std::uint64_t otherwise) {
  const char* const text = std::getenv(variable);  // NOLINT(concurrency-mt-unsafe): before any thread
  return text == nullptr ? otherwise : std::strtoull(text, nullptr, 10);
}

class Gate : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(oracle_);
    seeds_ = oracle_->seeds();
    ASSERT_GT(seeds_.size(), 50U);
  }
  void feed(const Packet& packet, std::uint64_t number) {
    if (oracle_->feed(packet)) return;
    const auto file = std::filesystem::temp_directory_path() / fmt::format("gate-{}.packets", number);
    oracle_->save_last(file);
    FAIL() << "Cyclone ended or hung at packet " << number << "; the last ones are in " << file;
  }

  using Prefix = std::array<std::byte, 12>;
  static std::byte any_octet(std::mt19937& random) { return static_cast<std::byte>(random() % 256); }
  static void change(Packet& packet, std::mt19937& random) {
    constexpr std::array kEdges{0x75U, 0x00U, 0xffU, 0xf2U};
    constexpr std::size_t kHeader = 24;
    for (std::uint32_t flips = 1 + random() % 4; flips > 0; --flips) {
      const std::size_t at = kHeader + random() % (packet.size() - kHeader);
      packet[at] = (random() & 1U) != 0 ? any_octet(random)
                                        : static_cast<std::byte>(kEdges.at(random() % kEdges.size()));
    }
  }
  /// The participant that has said most, and what it said first.
  [[nodiscard]] std::pair<Prefix, std::vector<Packet>> of_the_client() const {
    constexpr std::size_t kMost = 40;
    std::map<Prefix, std::vector<Packet>> all;
    for (const Packet& seed : seeds_) {
      Prefix prefix{};
      if (seed.size() > 40) std::copy_n(seed.begin() + 8, prefix.size(), prefix.begin());
      all[prefix].push_back(seed);
    }
    auto most =
        *std::ranges::max_element(all, {}, [](const auto& participant) { return participant.second.size(); });
    most.second.resize(std::min(most.second.size(), kMost));
    return most;
  }

  OwnDomain domain_;
  std::optional<CycloneOracle> oracle_ = CycloneOracle::start(GATED_CYCLONE_PROGRAM, domain_.number());
  std::vector<Packet> seeds_;
};

TEST_F(Gate, PassesWhatAClientSays) {
  for (std::size_t i = 0; i < seeds_.size(); ++i) ASSERT_NO_FATAL_FAILURE(feed(seeds_[i], i));
  ASSERT_TRUE(oracle_->flush());
  EXPECT_EQ(oracle_->passed(), seeds_.size());
}

// For longer runs: PLCHOST_GATE_PACKETS, PLCHOST_GATE_SEED.
TEST_F(Gate, PassesNoMutatedPacketThatEndsCyclone) {
  const std::uint64_t count = number_from("PLCHOST_GATE_PACKETS", 60'000);
  std::mt19937 random(static_cast<std::uint32_t>(number_from("PLCHOST_GATE_SEED", 1)));
  for (std::uint64_t i = 0; i < count; ++i) {
    ASSERT_NO_FATAL_FAILURE(feed(mutated(seeds_, random), i));
    // Its participants are forgotten when they are silent, and what is said in their name with them.
    if (i % 500 == 0) {
      for (const Packet& seed : seeds_) ASSERT_NO_FATAL_FAILURE(feed(seed, i));
    }
  }
  ASSERT_TRUE(oracle_->flush());
  EXPECT_GT(oracle_->passed(), count / 10);
}

// Of a participant that is known, DDS reads what it announces only once: so here many participants announce
// what the client did, each with some octets changed. Without the gate 0.10.2 aborts on type information
// within some 10,000 packets.
TEST_F(Gate, PassesNoAnnouncementThatEndsCyclone) {
  std::mt19937 random(static_cast<std::uint32_t>(number_from("PLCHOST_GATE_SEED", 2)));
  const std::uint64_t count = number_from("PLCHOST_GATE_PACKETS", 40'000);
  const auto [prefix, packets] = of_the_client();
  ASSERT_GT(packets.size(), 10U);
  for (std::uint64_t number = 0; number < count;) {
    Prefix another = prefix;
    for (auto octet = another.begin() + 4; octet != another.end(); ++octet) *octet = any_octet(random);
    for (std::size_t i = 0; i < packets.size(); ++i, ++number) {
      Packet packet = packets[i];
      for (auto at = packet.begin();;) {
        at = std::search(at, packet.end(), prefix.begin(), prefix.end());
        if (at == packet.end()) break;
        at = std::ranges::copy(another, at).out;
      }
      // Of another vendor: Cyclone waits for a heartbeat of its own before it takes the first sample.
      packet[6] = std::byte{1};
      packet[7] = std::byte{15};
      if (i > 0 && (random() & 1U) != 0) change(packet, random);
      ASSERT_NO_FATAL_FAILURE(feed(packet, number));
      if (i > 0) continue;
      ASSERT_TRUE(oracle_->flush());
      std::this_thread::sleep_for(std::chrono::microseconds(400));  // it is made on another thread
    }
  }
  ASSERT_TRUE(oracle_->flush());
  EXPECT_GT(oracle_->passed(), count / 2);
}

}  // namespace
}  // namespace plchost
