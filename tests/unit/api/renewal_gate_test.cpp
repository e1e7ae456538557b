#include "api/dds/gate/renewal_gate.hpp"

#include <algorithm>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

namespace plchost::dds {
namespace {

using namespace std::string_literals;

constexpr std::string_view kSender = "client prefi";
constexpr std::string_view kOther = "other prefix";
constexpr std::string_view kReceiver = "host prefix.";

std::string cdr_word(std::uint32_t number) {
  std::string made;
  for (unsigned i = 0; i < 4; ++i) made += static_cast<char>(number >> (8 * i));
  return made;
}

std::string cdr_text(std::string_view value) {
  std::string made = cdr_word(static_cast<std::uint32_t>(value.size() + 1)) + std::string(value);
  made.resize((made.size() + 4) / 4 * 4);
  return made;
}

std::string cdr_property(std::string_view name, char octet, std::uint32_t size = kChallenge) {
  return cdr_text(name) + cdr_word(size) + std::string(kChallenge, octet);
}

/// A message of a handshake, as contents of a sample.
std::string token_message(std::string_view class_id, const std::string& properties) {
  std::string made("\x00\x01\x00\x00", 4);
  made.append(48, 'i');  // its identity, and that of the one that it answers
  made += std::string(kReceiver) + "\x00\x00\x01\xc1"s;
  made.append(32, 'e');
  return made + cdr_text("dds.sec.auth") + cdr_word(1) + cdr_text(class_id) + cdr_word(0) + cdr_word(2) +
         cdr_property("hash_c1", 'h') + properties;
}

std::string part_of(std::uint8_t kind, const std::string& body) {
  const auto size = static_cast<std::uint32_t>(body.size());
  return std::string{static_cast<char>(kind), '\x05', static_cast<char>(size), static_cast<char>(size >> 8)} +
         body;
}

std::string handshake_part(const std::string& contents) {
  return part_of(
      0x15, "\x00\x00\x10\x00\x00\x02\x01\xc4\x00\x02\x01\xc3\x00\x00\x00\x00\x07\x00\x00\x00"s + contents);
}

std::string heartbeat_part() {
  return part_of(0x07, std::string(28, '\x01'));
}

std::string header_of(std::string_view sender) {
  return "RTPS\x02\x01\x01\x10"s + std::string(sender);
}

std::span<const std::byte> octets_of(const std::string& contents) {
  return std::as_bytes(std::span(contents));
}

/// The calls of the gate in this test, and the answers.
struct GateTold {
  std::vector<std::string> noted;
  SignUse use = SignUse::usual;
  std::string doubted;
};
GateTold gate_told;

std::string octets_text(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

SignUse take_sign(std::span<const std::byte> from, const HandshakeSign& sign) {
  const std::string answered = sign.answered.empty() ? "-" : octets_text(sign.answered.first(1));
  gate_told.noted.push_back(octets_text(from) + "|" + octets_text(sign.to) + "|" +
                            octets_text(sign.challenge.first(1)) + answered);
  return gate_told.use;
}

bool is_doubted(std::span<const std::byte> from) {
  return octets_text(from) == gate_told.doubted;
}

class RenewalGate : public testing::Test {
 protected:
  RenewalGate() { gate_told = {}; }
  /// The rest of the datagram.
  static std::string pass(std::string datagram) {
    const auto bytes = std::as_writable_bytes(std::span(datagram));
    datagram.resize(take_out_doubted(bytes, {.take = take_sign, .is_doubted = is_doubted}));
    return datagram;
  }
};

/// The sender's own challenge and the one that it answers, each by its first octet.
std::string challenges_of(const std::string& contents) {
  const auto sign = read_handshake_sign(octets_of(contents));
  if (!sign) return "";
  const auto first = [](std::span<const std::byte> challenge) {
    return challenge.empty() ? '-' : std::to_integer<char>(challenge[0]);
  };
  return {first(sign->challenge), first(sign->answered)};
}

TEST_F(RenewalGate, EachMessageTellsItsSendersOwnChallengeAndTheOneThatItAnswers) {
  const std::string both = cdr_property("challenge1", '1') + cdr_property("challenge2", '2');
  EXPECT_EQ(
      challenges_of(token_message("DDS:Auth:PKI-DH:1.0+AuthReq", cdr_property("future_challenge", 'f'))),
      "f-");
  EXPECT_EQ(challenges_of(token_message("DDS:Auth:PKI-DH:1.0+Req", both)), "1-");
  EXPECT_EQ(challenges_of(token_message("DDS:Auth:PKI-DH:1.0+Reply", both)), "21");
  EXPECT_EQ(challenges_of(token_message("DDS:Auth:PKI-DH:1.0+Final", both)), "12");
  EXPECT_EQ(challenges_of(token_message("DDS:Auth:PKI-DH:1.0+Reply", cdr_property("challenge2", '2'))), "");
  EXPECT_EQ(challenges_of(token_message("DDS:Auth:PKI-DH:1.0+Other", both)), "");
}

TEST_F(RenewalGate, TheTextOfAnotherClassInAMessageMakesNoOtherMessageOfIt) {
  const std::string properties = cdr_property("challenge1", '1') + cdr_property("challenge2", '2') +
                                 cdr_property("future_challenge", 'f');
  const std::string other = cdr_property("DDS:Auth:PKI-DH:1.0+AuthReq", 'o');
  EXPECT_EQ(challenges_of(token_message("DDS:Auth:PKI-DH:1.0+Final", other + properties)), "12");
  EXPECT_EQ(challenges_of(token_message("DDS:Auth:PKI-DH:1.0+Final\0+Other"s, properties)), "12");
  const std::string usual = cdr_text("dds.sec.auth");
  std::string behind_another = token_message("DDS:Auth:PKI-DH:1.0+Final", properties);
  behind_another.replace(behind_another.find(usual), usual.size(), cdr_text("DDS:Auth:PKI-DH:1.0+AuthReq"));
  EXPECT_EQ(challenges_of(behind_another), "12");
}

TEST_F(RenewalGate, AMessageThatIsCutOrHasAnotherSizeTellsNothing) {
  const std::string whole = token_message("DDS:Auth:PKI-DH:1.0+Req", cdr_property("challenge1", '1'));
  for (std::size_t size = 0; size < whole.size(); ++size)
    EXPECT_FALSE(read_handshake_sign(octets_of(whole.substr(0, size)))) << size;
  EXPECT_TRUE(read_handshake_sign(octets_of(whole)));
  const std::string other = token_message("DDS:Auth:PKI-DH:1.0+Req", cdr_property("challenge1", '1', 31));
  EXPECT_FALSE(read_handshake_sign(octets_of(other)));
}

TEST_F(RenewalGate, ChallengesAreNotedWithSenderAndReceiver) {
  const std::string datagram =
      header_of(kSender) +
      handshake_part(token_message("DDS:Auth:PKI-DH:1.0+Req", cdr_property("challenge1", '1')));
  EXPECT_EQ(pass(datagram), datagram);
  EXPECT_EQ(gate_told.noted, std::vector{std::string(kSender) + "|" + std::string(kReceiver) + "|1-"});
}

TEST_F(RenewalGate, AMessageOfNoUseIsTakenOut) {
  gate_told.use = SignUse::none;
  const std::string both = cdr_property("challenge1", '1') + cdr_property("challenge2", '2');
  const std::string reply = handshake_part(token_message("DDS:Auth:PKI-DH:1.0+Reply", both));
  EXPECT_EQ(pass(header_of(kSender) + reply), "");
  EXPECT_TRUE(pass(header_of(kSender) + reply + heartbeat_part()).ends_with(heartbeat_part()));
}

TEST_F(RenewalGate, PlainMessagesOfADoubtedParticipantAreTakenOut) {
  gate_told.doubted = kSender;
  EXPECT_EQ(pass(header_of(kSender) + heartbeat_part()), "");
  EXPECT_EQ(pass(header_of(kOther) + heartbeat_part()), header_of(kOther) + heartbeat_part());
  // Keys are gate_told in submessages that are secured one by one.
  const std::string key = part_of(0x31, std::string(20, 'k'));
  const std::string left = pass(header_of(kSender) + heartbeat_part() + key);
  EXPECT_EQ(left.size(), (header_of(kSender) + heartbeat_part() + key).size());
  EXPECT_EQ(left.at(20), '\x01');
  EXPECT_TRUE(left.ends_with(key));
}

TEST_F(RenewalGate, AnAwaitedAnswerOfADoubtedParticipantPasses) {
  gate_told.doubted = kSender;
  const std::string both = cdr_property("challenge1", '1') + cdr_property("challenge2", '2');
  const std::string datagram =
      header_of(kSender) + handshake_part(token_message("DDS:Auth:PKI-DH:1.0+Final", both));
  EXPECT_EQ(pass(datagram), "");
  gate_told.use = SignUse::awaited;
  EXPECT_EQ(pass(datagram), datagram);
}

// Cyclone would refuse it, and then repeat its own message no more.
TEST_F(RenewalGate, AMessageWithoutTheChallengesOfItsClassIsTakenOut) {
  for (const char* end : {"+AuthReq", "+Req", "+Reply", "+Final"}) {
    const std::string contents = token_message("DDS:Auth:PKI-DH:1.0"s + end, cdr_property("other", '1'));
    EXPECT_EQ(pass(header_of(kSender) + handshake_part(contents)), "") << end;
  }
  EXPECT_TRUE(gate_told.noted.empty());
}

TEST_F(RenewalGate, EachPartIsOfTheParticipantThatSaysIt) {
  gate_told.doubted = kOther;
  const std::string source = part_of(0x0c, std::string(4, '\0') + "\x02\x01\x01\x10"s + std::string(kOther));
  const std::string left = pass(header_of(kSender) + heartbeat_part() + source + heartbeat_part());
  EXPECT_TRUE(left.starts_with(header_of(kSender) + heartbeat_part() + source));
  EXPECT_EQ(left.at(20 + 32 + 24), '\x01');
}

TEST_F(RenewalGate, AMessageThatIsSecuredAsAWholePasses) {
  gate_told.doubted = kSender;
  const std::string datagram = header_of(kSender) + part_of(0x33, std::string(20, 's')) + heartbeat_part();
  EXPECT_EQ(pass(datagram), datagram);
}

}  // namespace
}  // namespace plchost::dds
