#include "api/dds/gate/parameter_filter.hpp"

#include <array>
#include <cstdint>
#include <random>
#include <span>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

namespace plchost::dds {
namespace {

using Octets = std::vector<std::uint8_t>;

constexpr std::array<std::byte, 12> kPrefix{std::byte{1}, std::byte{2}, std::byte{3}};

/// A list of parameters, little-endian.
class List {
 public:
  List& add(std::uint16_t parameter, const Octets& value) {
    put(parameter, 2);
    put(static_cast<std::uint32_t>(value.size()), 2);
    bytes.insert(bytes.end(), value.begin(), value.end());
    return *this;
  }
  List& end() {
    put(1, 2);
    put(0, 2);
    return *this;
  }
  std::size_t filter(ParameterList kind = ParameterList::discovery) {
    return filter_parameters(std::as_writable_bytes(std::span(bytes)), true, kind, kPrefix);
  }
  std::uint16_t first() const { return static_cast<std::uint16_t>(bytes.at(0) | bytes.at(1) << 8U); }

  Octets bytes;

 private:
  void put(std::uint32_t number, std::size_t size) {
    for (std::size_t i = 0; i < size; ++i) bytes.push_back(static_cast<std::uint8_t>(number >> (8 * i)));
  }
};

Octets text(std::string_view text) {
  Octets made{static_cast<std::uint8_t>(text.size() + 1), 0, 0, 0};
  made.insert(made.end(), text.begin(), text.end());
  made.push_back(0);
  while (made.size() % 4 != 0) made.push_back(0);
  return made;
}

bool passes(std::uint16_t parameter, const Octets& value) {
  return List().add(parameter, value).end().filter() != 0;
}

TEST(ParameterFilter, LeavesWhatTheHostNeedsAsItIs) {
  List sut;
  sut.add(0x0005, text("plc/v1/event")).add(0x001a, Octets(12, 1)).end();
  const Octets before = sut.bytes;
  EXPECT_EQ(sut.filter(), before.size());
  EXPECT_EQ(sut.bytes, before);
}

TEST(ParameterFilter, MakesPaddingOfAllOthers) {
  for (const std::uint16_t parameter :
       {0x0075, 0x0074, 0x0072, 0x0059, 0x1001, 0x0035, 0x8012, 0x801b, 0x7fff & ~0x4000}) {
    List sut;
    sut.add(parameter, Octets(12, 0xff)).end();
    EXPECT_NE(sut.filter(), 0U) << parameter;
    EXPECT_EQ(sut.first(), 0U) << parameter;
  }
}

TEST(ParameterFilter, MakesPaddingOfAnotherVendorsMeaningOfANumber) {
  List of_fast_dds;
  of_fast_dds.add(0x8007, {1, 0, 0, 0}).end();
  EXPECT_NE(of_fast_dds.filter(), 0U);
  EXPECT_EQ(of_fast_dds.first(), 0U);
}

TEST(ParameterFilter, LeavesItToDdsToRefuseWhatMustBeKnown) {
  List sut;
  sut.add(0x4075, Octets(4)).end();
  EXPECT_NE(sut.filter(), 0U);
  EXPECT_EQ(sut.first(), 0x4075U);
}

TEST(ParameterFilter, KeepsTokensOfASecuredHostOnly) {
  List sut;
  sut.add(0x1001, Octets(8)).end();
  EXPECT_NE(sut.filter(ParameterList::secured_discovery), 0U);
  EXPECT_EQ(sut.first(), 0x1001U);
  EXPECT_NE(sut.filter(ParameterList::discovery), 0U);
  EXPECT_EQ(sut.first(), 0U);
  List type;
  type.add(0x0075, Octets(8)).end();
  EXPECT_NE(type.filter(ParameterList::secured_discovery), 0U);
  EXPECT_EQ(type.first(), 0U);
}

TEST(ParameterFilter, KeepsOfInlineQosTheKeyAndTheStatus) {
  List sut;
  sut.add(0x0005, text("x")).add(0x0070, Octets(16)).add(0x0071, Octets(4)).end();
  EXPECT_NE(sut.filter(ParameterList::inline_qos), 0U);
  EXPECT_EQ(sut.first(), 0U);
  EXPECT_EQ(sut.bytes.at(4 + 8), 0x70);
}

TEST(ParameterFilter, RefusesValuesOfAnotherForm) {
  EXPECT_FALSE(passes(0x001a, Octets(8)));
  EXPECT_FALSE(passes(0x001a, Octets(16)));
  EXPECT_TRUE(passes(0x0005, text("")));
  EXPECT_FALSE(passes(0x0005, {}));
  EXPECT_FALSE(passes(0x0005, Octets(4))) << "not even a terminating zero";
  EXPECT_FALSE(passes(0x0005, {5, 0, 0, 0, 'a', 'b', 'c', 0}));
  EXPECT_FALSE(passes(0x0005, {4, 0, 0, 0, 'a', 'b', 'c', 'd'}));
  EXPECT_TRUE(passes(0x002c, {3, 0, 0, 0, 1, 2, 3, 0}));
  EXPECT_FALSE(passes(0x002c, {5, 0, 0, 0, 1, 2, 3, 0}));
  EXPECT_TRUE(passes(0x0073, {2, 0, 0, 0, 0, 0, 1, 0}));
  EXPECT_FALSE(passes(0x0073, {3, 0, 0, 0, 0, 0, 1, 0}));
  EXPECT_FALSE(passes(0x0073, {0, 0, 0, 0x80, 0, 0, 1, 0}));
}

TEST(ParameterFilter, FollowsSequencesOfTexts) {
  Octets two{2, 0, 0, 0};
  for (const char* name : {"h.cell", "c"}) {
    const Octets one = text(name);
    two.insert(two.end(), one.begin(), one.end());
  }
  EXPECT_TRUE(passes(0x0029, two));
  two[0] = 3;
  EXPECT_FALSE(passes(0x0029, two));
  two[3] = 0xff;
  EXPECT_FALSE(passes(0x0029, two));
}

TEST(ParameterFilter, AParticipantSpeaksForItselfOnly) {
  Octets guid(16);
  for (std::size_t i = 0; i < kPrefix.size(); ++i) guid[i] = std::to_integer<std::uint8_t>(kPrefix[i]);
  for (const std::uint16_t parameter : {0x0050, 0x005a}) {
    EXPECT_TRUE(passes(parameter, guid));
    Octets other = guid;
    other[11] ^= 1;
    EXPECT_FALSE(passes(parameter, other));
  }
}

TEST(ParameterFilter, TakesAwayBuiltinEndpointsThatTheGateClosesTo) {
  List sut;
  sut.add(0x0058, {0xff, 0xff, 0xff, 0xff}).end();
  EXPECT_NE(sut.filter(), 0U);
  EXPECT_EQ(Octets(sut.bytes.begin() + 4, sut.bytes.begin() + 8), (Octets{0x3f, 0x0c, 0, 0}));
}

TEST(ParameterFilter, BoundsLocators) {
  List sut;
  for (int i = 0; i < 32; ++i) sut.add(0x0031, Octets(24));
  List more = sut;
  EXPECT_NE(sut.end().filter(), 0U);
  EXPECT_EQ(more.add(0x002f, Octets(24)).end().filter(), 0U);
}

TEST(ParameterFilter, RefusesListsThatDoNotEnd) {
  EXPECT_EQ(List().filter(), 0U);
  EXPECT_EQ(List().add(0x0006, Octets(4)).filter(), 0U);
  List beyond;
  beyond.add(0x0075, Octets(4)).end();
  beyond.bytes[2] = 12;
  EXPECT_EQ(beyond.filter(), 0U);
  List odd;
  odd.add(0x0075, Octets(3)).end();
  EXPECT_EQ(odd.filter(), 0U);
}

TEST(ParameterFilter, ReadsNothingBehindTheEnd) {
  std::mt19937 random(1);
  for (int i = 0; i < 200'000; ++i) {
    // Of exactly that size on the heap, for the address sanitizer.
    std::vector<std::byte> list(random() % 48);
    for (std::byte& byte : list) byte = static_cast<std::byte>(random() % ((i & 2) != 0 ? 128 : 12));
    list.shrink_to_fit();
    EXPECT_LE(filter_parameters(list, (i & 1) != 0, ParameterList::discovery, kPrefix), list.size());
  }
}

}  // namespace
}  // namespace plchost::dds
