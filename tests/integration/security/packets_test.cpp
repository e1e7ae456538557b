// An attacker on the wire without a key: it sends packets again that it saw, unchanged or altered.
#include "tests/integration/security/packets.hpp"

#include <algorithm>
#include <array>
#include <thread>

#include "tests/integration/security/secured_host.hpp"

namespace plchost {
namespace {

/// The message with "contents" turned into "key" in each sample of the writer that the handshake uses; empty:
/// it has none.
Packet with_key_for_contents(Packet packet) {
  constexpr std::array kHandshakeWriter{std::byte{0x00}, std::byte{0x02}, std::byte{0x01}, std::byte{0xc3}};
  bool found = false;
  for (std::size_t at = 20; at + 16 <= packet.size();) {
    const auto size =
        std::to_integer<std::size_t>(packet[at + 2]) | std::to_integer<std::size_t>(packet[at + 3]) << 8U;
    const auto writer = packet.begin() + static_cast<std::ptrdiff_t>(at) + 12;
    const bool is_data = packet[at] == std::byte{0x15};
    if ((is_data || packet[at] == std::byte{0x16}) &&
        std::equal(kHandshakeWriter.begin(), kHandshakeWriter.end(), writer)) {
      packet[at + 1] =
          is_data ? (packet[at + 1] & ~std::byte{0x04}) | std::byte{0x08} : packet[at + 1] | std::byte{0x04};
      found = true;
    }
    if (size == 0) break;
    at += 4 + size;
  }
  return found ? packet : Packet();
}

constexpr std::size_t kRtpsHeader = 20;
constexpr std::array<unsigned char, 4> kHandshakeWriter{0x00, 0x02, 0x01, 0xc3};

/// Whether it names the writer of the handshake: its sender is known to the host.
bool is_of_handshake(const Packet& packet) {
  return packet.size() > kRtpsHeader &&
         std::ranges::search(packet, std::as_bytes(std::span(kHandshakeWriter))).size() > 0;
}

struct Pieces {
  std::uint32_t first = 1;
  std::uint16_t count = 1;
  std::uint16_t size = 0;
};

/// Fragments of a sample of that size, as the sender of `packet` would send them.
Packet handshake_fragment(const Packet& packet, std::uint32_t number, const Pieces& pieces,
                          std::uint32_t sample_size) {
  Packet made(packet.begin(), packet.begin() + kRtpsHeader);
  const auto put = [&made](std::uint32_t value, std::size_t bytes) {
    for (std::size_t i = 0; i < bytes; ++i) made.push_back(static_cast<std::byte>(value >> (8 * i)));
  };
  const std::uint32_t contents = std::uint32_t{pieces.count} * pieces.size;
  put(0x0116, 2);  // a fragment, little-endian
  put(32 + contents, 2);
  put(0, 2);
  put(28, 2);
  put(0, 4);  // whichever reader
  for (const unsigned char byte : kHandshakeWriter) put(byte, 1);
  put(0, 4);
  put(number, 4);
  put(pieces.first, 4);
  put(pieces.count, 2);
  put(pieces.size, 2);
  put(sample_size, 4);
  put(0x0300, 4);  // CDR_LE parameters
  made.resize(made.size() + contents - 4, std::byte{0x41});
  return made;
}

class Packets : public SecuredHost {
 protected:
  void SetUp() override {
    capture_ = PacketCapture::open(domain_.number());
    if (!capture_) GTEST_SKIP() << capture_.error().describe();
    start();
    dds::DomainOptions options;
    options.domain = domain_.number();
    options.identity = folder("operator");
    client_ = ControlClient::connect(options).value();
    post(kPosts);
    seen_ = capture_->take();
    ASSERT_GT(seen_.size(), 10U);
  }
  /// By the client that has the right; each is acknowledged.
  void post(std::uint64_t count) {
    const auto report = client_->post_event({"cell", "line1", "ready"}, count, {}, kPatience);
    ASSERT_TRUE(report) << report.error().describe();
    ASSERT_EQ(report->accepted, count);
    expected_ += count;
  }
  /// All of them have counted, and nothing else has.
  void only_those_have_counted() {
    post(1);
    EXPECT_EQ(event_.counted().count(), expected_);
    EXPECT_EQ(::kill(host_.server().pid(), 0), 0);
    EXPECT_TRUE(host_.requests().empty());
  }

  static constexpr std::uint64_t kPosts = 100;
  Result<PacketCapture> capture_ = failure(ErrorCode::unavailable, "not opened");
  std::unique_ptr<ControlClient> client_;
  std::uint64_t expected_ = 0;
  std::vector<Packet> seen_;
};

TEST_F(Packets, SentAgainPostNothing) {
  const PacketSender sender(domain_.number());
  for (int i = 0; i < 20; ++i) {
    sender.send(seen_);
    only_those_have_counted();
  }
}

TEST_F(Packets, AlteredPostNothing) {
  const PacketSender sender(domain_.number());
  std::mt19937 random(1);
  for (int i = 0; i < 20; ++i) {
    std::vector<Packet> altered = seen_;
    for (Packet& packet : altered) {
      const auto at = std::uniform_int_distribution<std::size_t>(4, packet.size() - 1)(random);
      packet[at] ^= std::byte{1} << std::uniform_int_distribution<unsigned>(0, 7)(random);
    }
    sender.send(altered);
    only_those_have_counted();
  }
}

// Cyclone 0.10.2 follows a null pointer there.
TEST_F(Packets, OfTheHandshakeWithAKeyForContentsHarmNobody) {
  std::vector<Packet> altered;
  for (const Packet& packet : seen_) {
    if (Packet made = with_key_for_contents(packet); !made.empty()) altered.push_back(std::move(made));
  }
  ASSERT_FALSE(altered.empty()) << "no message of a handshake was seen";
  const PacketSender sender(domain_.number());
  for (int i = 0; i < 20; ++i) {
    sender.send(altered);
    only_those_have_counted();
  }
}

// Cyclone 0.10.2 takes memory for the size that the first one says, and copies what the second one has.
TEST_F(Packets, OfTheHandshakeInFragmentsThatDoNotAgreeHarmNobody) {
  const auto handshake =
      std::ranges::find_if(seen_, [](const Packet& packet) { return is_of_handshake(packet); });
  ASSERT_NE(handshake, seen_.end()) << "no message of a handshake was seen";
  const PacketSender sender(domain_.number());
  for (std::uint32_t number = 1000; number < 1020; ++number) {
    constexpr std::uint16_t kPiece = 1344;
    constexpr std::uint16_t kPieces = 40;
    sender.send({handshake_fragment(*handshake, number, {.first = 1, .count = 1, .size = kPiece}, 2000),
                 handshake_fragment(*handshake, number, {.first = 2, .count = kPieces, .size = kPiece},
                                    (kPieces + 1U) * kPiece)});
    only_those_have_counted();
  }
}

TEST_F(Packets, MutatedInAFloodHarmNobody) {
  std::atomic<bool> stop{false};
  std::jthread flood([&] {
    const PacketSender sender(domain_.number());
    std::mt19937 random(2);
    while (!stop) {
      std::vector<Packet> batch(200);
      for (Packet& packet : batch) packet = mutated(seen_, random);
      sender.send(batch);
    }
  });
  for (int i = 0; i < 20; ++i) {
    only_those_have_counted();
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  stop = true;
  flood.join();
  only_those_have_counted();
}

}  // namespace
}  // namespace plchost
