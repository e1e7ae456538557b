#include "api/dds/gate/packet_gate.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <initializer_list>
#include <random>
#include <span>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "api/dds/gate/submessage.hpp"

namespace plchost::dds {
namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr std::array<std::uint8_t, 4> kHandshake{0x00, 0x02, 0x01, 0xc3};
constexpr std::array<std::uint8_t, 4> kParticipant{0x00, 0x01, 0x00, 0xc2};
constexpr std::array<std::uint8_t, 4> kUser{0x00, 0x00, 0x01, 0x03};

Bytes header() {
  return {'R', 'T', 'P', 'S', 2, 1, 1, 16, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12};
}

/// With so many bytes behind its header.
Bytes submessage(std::uint8_t kind, std::uint8_t flags, std::uint16_t size) {
  Bytes made{kind, flags, static_cast<std::uint8_t>(size), static_cast<std::uint8_t>(size >> 8U)};
  made.resize(4U + size);
  return made;
}

Bytes sample(std::uint8_t kind, std::uint8_t flags, const std::array<std::uint8_t, 4>& writer) {
  Bytes made = submessage(kind, flags, 40);
  made[6] = kind == 0x15 ? 16 : 28;  // octets to the inline QoS
  std::ranges::copy(writer, made.begin() + 12);
  if (writer == kParticipant && kind == 0x15) {
    made[25] = 3;  // parameters, little-endian: none
    made[28] = 1;
  }
  return made;
}

Bytes datagram_of(std::initializer_list<Bytes> parts) {
  Bytes datagram = header();
  for (const Bytes& part : parts) datagram.insert(datagram.end(), part.begin(), part.end());
  return datagram;
}

/// Passed or refused, but not cut.
bool passes(std::initializer_list<Bytes> parts, bool secured = true) {
  Bytes datagram = datagram_of(parts);
  const Admission admission = admit(std::as_writable_bytes(std::span(datagram)), secured);
  EXPECT_NE(admission, Admission::cut);
  return admission == Admission::whole;
}

/// The bytes that Cyclone gets; empty: none.
Bytes after_gate(std::initializer_list<Bytes> parts, bool secured) {
  Bytes datagram = datagram_of(parts);
  if (admit(std::as_writable_bytes(std::span(datagram)), secured) == Admission::refused) return {};
  return datagram;
}

constexpr std::array<std::uint8_t, 4> kLiveliness{0x00, 0x02, 0x00, 0xc2};

/// As Cyclone sends it.
Bytes liveliness() {
  Bytes alive = submessage(0x15, 5, 48);  // fields, encapsulation, GUID and kind, length, 4 octets
  alive[6] = 16;
  std::ranges::copy(kLiveliness, alive.begin() + 12);
  alive[25] = 1;
  const Bytes prefix = header();
  std::copy_n(prefix.begin() + 8, 12, alive.begin() + 28);
  alive[44] = 4;
  return alive;
}

TEST(PacketGate, PassesWhatIsWellFormed) {
  EXPECT_TRUE(passes({}));
  EXPECT_TRUE(passes({submessage(0x09, 1, 8), sample(0x15, 5, kParticipant)}));
  EXPECT_TRUE(passes({submessage(0x09, 1, 0), submessage(0x01, 1, 0)}));
  EXPECT_TRUE(passes({sample(0x15, 5, kHandshake)}));
  EXPECT_TRUE(passes({sample(0x16, 1, kHandshake)}));
}

TEST(PacketGate, RefusesWhatIsNoRtps2) {
  for (std::size_t i = 0; i < 5; ++i) {
    Bytes datagram = header();
    datagram[i] ^= 1;
    EXPECT_EQ(admit(std::as_writable_bytes(std::span(datagram)), false), Admission::refused);
  }
  Bytes whole = header();
  for (std::size_t size = 0; size < whole.size(); ++size) {
    EXPECT_EQ(admit(std::as_writable_bytes(std::span(whole)).first(size), false), Admission::refused);
  }
}

TEST(PacketGate, RefusesSubmessagesThatDoNotFillTheDatagram) {
  EXPECT_FALSE(passes({{0x09, 1}}, false));
  Bytes longer = submessage(0x07, 1, 8);
  longer[2] = 12;
  EXPECT_FALSE(passes({longer}, false));
  EXPECT_FALSE(passes({submessage(0x07, 1, 6)}, false));
  EXPECT_FALSE(passes({submessage(0x07, 1, 8), {0, 0}}, false));
  Bytes big_endian = submessage(0x07, 0, 8);
  EXPECT_FALSE(passes({big_endian}, false));
  std::swap(big_endian[2], big_endian[3]);
  EXPECT_TRUE(passes({big_endian}, false));
}

TEST(PacketGate, RefusesAKeyWhereTheHandshakesContentsMustBe) {
  constexpr std::uint8_t kKey = 0x08;
  EXPECT_FALSE(passes({sample(0x15, 1 | kKey, kHandshake)}));
  EXPECT_FALSE(passes({sample(0x15, 5 | kKey, kHandshake)}));
  EXPECT_FALSE(passes({sample(0x15, 1, kHandshake)}));
  EXPECT_FALSE(passes({sample(0x16, 5, kHandshake)}));
  EXPECT_TRUE(passes({sample(0x15, 1 | kKey, kParticipant)})) << "a participant that goes says so by its key";
}

TEST(PacketGate, RefusesSamplesOfTheFirstWritersWhoseFieldsAreNotInPlace) {
  for (const auto& writer : {kHandshake, kParticipant}) {
    EXPECT_FALSE(passes({sample(0x15, 1, writer)})) << "neither contents nor key";
    EXPECT_FALSE(passes({sample(0x15, 13, writer)})) << "both";
    for (const std::uint8_t kind : {0x15, 0x16}) {
      const std::uint8_t flags = kind == 0x15 ? 5 : 1;
      Bytes elsewhere = sample(kind, flags, writer);
      elsewhere[6] = 36;
      EXPECT_FALSE(passes({elsewhere}));
      Bytes shorter = submessage(kind, flags, kind == 0x15 ? 20 : 32);
      std::ranges::copy(writer, shorter.begin() + 12);
      shorter[6] = kind == 0x15 ? 16 : 28;
      EXPECT_FALSE(passes({shorter})) << "no room for contents";
    }
  }
}

TEST(PacketGate, FollowsTheInlineQosToItsEnd) {
  Bytes with_qos = sample(0x15, 7, kHandshake);
  with_qos[24] = 0x70;  // a parameter of 4 bytes, then the end, then contents
  with_qos[26] = 4;
  with_qos[32] = 1;
  EXPECT_TRUE(passes({with_qos}));
  with_qos[26] = 16;
  EXPECT_FALSE(passes({with_qos})) << "it does not fit";
  with_qos[26] = 3;
  EXPECT_FALSE(passes({with_qos}));
  with_qos[26] = 4;
  with_qos[32] = 2;
  EXPECT_FALSE(passes({with_qos})) << "it does not end";
}

TEST(PacketGate, RefusesPlainSamplesOfASecuredHostOnly) {
  EXPECT_FALSE(passes({sample(0x15, 5, kUser)}, true));
  EXPECT_TRUE(passes({sample(0x15, 5, kUser)}, false));
  EXPECT_TRUE(passes({submessage(0x33, 1, 16), sample(0x15, 5, kUser)}, true)) << "signed as a whole";
}

TEST(PacketGate, RefusesOfASecuredHostKindsThatNobodySaysBeforeThereAreKeys) {
  for (const std::uint8_t kind : {0x0d, 0x0f}) {
    EXPECT_FALSE(passes({submessage(kind, 1, 24)}, true)) << int{kind};
    EXPECT_TRUE(passes({submessage(kind, 1, 24)}, false)) << int{kind};
    EXPECT_TRUE(passes({submessage(0x33, 1, 16), submessage(kind, 1, 24)}, true)) << int{kind};
  }
  for (const std::uint8_t kind : {0x0c, 0x14, 0x7f}) {
    EXPECT_FALSE(passes({submessage(kind, 1, 24)}, true)) << int{kind};
    EXPECT_FALSE(passes({submessage(kind, 1, 24)}, false)) << int{kind};
  }
  for (const std::uint8_t kind : {0x30, 0x31, 0x32, 0x33}) {
    EXPECT_FALSE(passes({submessage(kind, 1, 24)}, false)) << int{kind} << ": there are no keys";
  }
  EXPECT_TRUE(passes(
      {submessage(0x0e, 1, 12), submessage(0x31, 1, 24), submessage(0x30, 1, 40), submessage(0x32, 1, 24)}));
  EXPECT_TRUE(passes({submessage(0x80, 1, 56)})) << "Fast DDS has one of its own beside each announcement";
  EXPECT_FALSE(passes({sample(0x16, 1, kParticipant)})) << "Cyclone does not put these together";
}

TEST(PacketGate, PassesOfAnUnsecuredHostsBuiltinSamplesDiscoveryAndLivelinessOnly) {
  constexpr std::array<std::uint8_t, 4> kPublications{0x00, 0x00, 0x03, 0xc2};
  constexpr std::array<std::uint8_t, 4> kTopics{0x00, 0x00, 0x02, 0xc2};
  constexpr std::array<std::uint8_t, 4> kTypeLookup{0x00, 0x03, 0x00, 0xc3};
  for (const auto& writer : {kTopics, kTypeLookup, kHandshake}) {
    EXPECT_FALSE(passes({sample(0x15, 5, writer)}, false)) << int{writer[1]};
  }
  EXPECT_FALSE(passes({sample(0x15, 5, kPublications)}, false)) << "no list of parameters";
  Bytes publication = sample(0x15, 5, kPublications);
  publication[25] = 3;
  publication[28] = 1;
  EXPECT_TRUE(passes({publication}, false));
  publication[25] = 4;
  EXPECT_FALSE(passes({publication}, false)) << "of another encapsulation";
  EXPECT_FALSE(passes({sample(0x16, 1, kPublications)}, false)) << "in fragments";
  EXPECT_TRUE(passes({sample(0x16, 1, kUser)}, false));
  EXPECT_FALSE(passes({sample(0x15, 1, kUser)}, false)) << "says nothing";
  EXPECT_FALSE(passes({sample(0x15, 13, kUser)}, false)) << "contents and key";
}

// Cyclone sends in one datagram what several participants of one process say.
TEST(PacketGate, KnowsEachParticipantOfADatagram) {
  Bytes source = submessage(0x0c, 1, 20);
  source[8] = 2;
  source[12] = 9;
  Bytes disposal = submessage(0x15, 9, 48);  // fields, encapsulation, its GUID, the end
  disposal[6] = 16;
  std::ranges::copy(kParticipant, disposal.begin() + 12);
  disposal[25] = 3;
  disposal[28] = 0x50;
  disposal[30] = 16;
  disposal[32] = 9;
  disposal[48] = 1;
  for (const bool secured : {false, true}) {
    EXPECT_TRUE(passes({source, disposal}, secured));
    EXPECT_FALSE(passes({disposal}, secured)) << "of another participant than the header's";
    Bytes of_version_3 = source;
    of_version_3[8] = 3;
    EXPECT_FALSE(passes({of_version_3, disposal}, secured));
  }
  Bytes datagram = header();
  datagram.insert(datagram.end(), source.begin(), source.end());
  std::vector<int> senders;
  EXPECT_TRUE(every_sender(std::as_bytes(std::span(datagram)), [&](const auto guid_prefix) {
    senders.push_back(std::to_integer<int>(guid_prefix[0]));
    return true;
  }));
  EXPECT_EQ(senders, (std::vector{1, 9}));
  EXPECT_FALSE(every_sender(std::as_bytes(std::span(datagram)),
                            [](const auto guid_prefix) { return guid_prefix[0] == std::byte{1}; }));
}

TEST(PacketGate, ChecksTheOctetsOfLiveliness) {
  Bytes alive = liveliness();
  EXPECT_TRUE(passes({alive}, false));
  alive[44] = 5;
  EXPECT_FALSE(passes({alive}, false));
  alive[47] = 0xff;
  EXPECT_FALSE(passes({alive}, false));
  Bytes of_another = liveliness();
  of_another[39] ^= 1;
  EXPECT_FALSE(passes({of_another}, false)) << "in the name of another participant";
}

// Cyclone sends them though the host must not believe them. The others beside it must come through, and a gap
// keeps the client from repeating them.
TEST(PacketGate, ReplacesPlainSamplesOfASecuredHostsClientsByGaps) {
  constexpr std::array<std::uint8_t, 4> kPublications{0x00, 0x00, 0x03, 0xc2};
  constexpr std::array<std::uint8_t, 4> kSubscriptions{0x00, 0x00, 0x04, 0xc2};
  const Bytes heartbeat = submessage(0x07, 1, 28);
  for (const bool little : {true, false}) {
    for (const auto& writer : {kLiveliness, kPublications, kSubscriptions}) {
      for (const std::uint8_t flags : {0x04, 0x0a}) {  // contents; key with an inline QoS
        Bytes said = submessage(0x15, static_cast<std::uint8_t>(flags | (little ? 1 : 0)), 48);
        if (!little) std::swap(said[2], said[3]);
        const Bytes reader{0, 2, 0, 0xc7};
        std::ranges::copy(reader, said.begin() + 8);
        std::ranges::copy(writer, said.begin() + 12);
        said[little ? 20 : 23] = 0xfe;  // its number

        Bytes gap = submessage(0x08, little ? 1 : 0, 28);
        if (!little) std::swap(gap[2], gap[3]);
        std::ranges::copy(reader, gap.begin() + 4);
        std::ranges::copy(writer, gap.begin() + 8);
        gap[little ? 16 : 19] = 0xfe;
        gap[little ? 24 : 27] = 0xff;
        Bytes padding = submessage(0x01, 1, 16);
        std::ranges::copy(said.end() - 16, said.end(), padding.begin() + 4);
        EXPECT_EQ(after_gate({heartbeat, said, heartbeat}, true),
                  datagram_of({heartbeat, gap, padding, heartbeat}));
        Bytes datagram = datagram_of({said});
        EXPECT_EQ(admit(std::as_writable_bytes(std::span(datagram)), true), Admission::whole)
            << "no warning is due";
      }
    }
  }
}

TEST(PacketGate, TakesOutASampleForWhichNoGapCanStand) {
  Bytes said = liveliness();
  said[20] = 7;
  EXPECT_TRUE(passes({said}, true));
  said[20] = 0;
  EXPECT_FALSE(passes({said}, true)) << "there is no sample 0";
  std::fill_n(said.begin() + 16, 8, std::uint8_t{0xff});
  EXPECT_FALSE(passes({said}, true));
  Bytes short_one = submessage(0x15, 9, 24);
  std::ranges::copy(kLiveliness, short_one.begin() + 12);
  short_one[20] = 7;
  EXPECT_FALSE(passes({short_one}, true));
  EXPECT_FALSE(passes({sample(0x16, 1, kLiveliness)}, true)) << "a fragment";
}

TEST(PacketGate, TakesOutWhatItDoesNotAdmitAndPassesTheRest) {
  const Bytes heartbeat = submessage(0x07, 1, 28);
  for (const bool secured : {false, true}) {
    const Bytes unwanted = sample(0x15, 5, secured ? kUser : kHandshake);
    Bytes padding = unwanted;
    padding[0] = 0x01;
    padding[1] = 1;
    EXPECT_EQ(after_gate({heartbeat, unwanted, heartbeat}, secured),
              datagram_of({heartbeat, padding, heartbeat}));
    // A length of 0 means "up to the end", but not of padding.
    Bytes to_the_end = unwanted;
    to_the_end[2] = 0;
    EXPECT_EQ(after_gate({heartbeat, to_the_end}, secured), datagram_of({heartbeat, padding}));
    EXPECT_EQ(after_gate({submessage(0x09, 1, 8), unwanted, submessage(0x0e, 1, 12)}, secured), Bytes{})
        << "nothing is left";
    Bytes source = submessage(0x0c, 1, 16);
    source[8] = 2;
    EXPECT_EQ(after_gate({heartbeat, source, heartbeat}, secured), Bytes{}) << "whose is the rest?";
  }
  const Bytes reply = submessage(0x0f, 1, 24);
  EXPECT_EQ(after_gate({heartbeat, reply}, true), datagram_of({heartbeat, submessage(0x01, 1, 24)}));
}

TEST(PacketGate, ReadsNothingBehindTheEnd) {
  std::mt19937 random(1);
  for (int i = 0; i < 200'000; ++i) {
    // Of exactly that size on the heap, for the address sanitizer.
    Bytes datagram = header();
    datagram.resize(20 + random() % 60);
    for (std::size_t at = 20; at < datagram.size(); ++at)
      datagram[at] = static_cast<std::uint8_t>(random() % 40);
    datagram.shrink_to_fit();
    const auto bytes = std::as_writable_bytes(std::span(datagram));
    const bool secured = (i & 1) != 0;
    if (admit(bytes, secured) != Admission::refused) {
      EXPECT_EQ(admit(bytes, secured), Admission::whole) << "a packet that has passed once passes";
    }
  }
}

}  // namespace
}  // namespace plchost::dds
