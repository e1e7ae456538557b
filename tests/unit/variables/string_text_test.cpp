// CHAR, WCHAR and WSTRING: their texts are UTF-8, their values are bytes and units of UTF-16.
#include <cstring>
#include <string>
#include <string_view>
#include <vector>

#include <gmock/gmock.h>

#include "shm/variables/variable_type.hpp"

namespace plchost {
namespace {

using testing::HasSubstr;

using Bytes = std::vector<std::byte>;

Bytes bytes_of(std::u16string_view units, std::size_t bytes) {
  Bytes memory(bytes);
  std::memcpy(memory.data(), units.data(), units.size() * sizeof(char16_t));
  return memory;
}

/// As STruC++ has it: for so many units.
Bytes sized(std::u16string_view units, std::size_t room) {
  Bytes memory = bytes_of(units, 2 * room + 4);
  const auto length = static_cast<std::uint16_t>(units.size());
  std::memcpy(memory.data() + memory.size() - 2, &length, sizeof length);
  return memory;
}

/// Also halves of pairs, which no literal has.
std::u16string units(std::initializer_list<char16_t> list) {
  return list;
}

std::string text_of(std::u16string_view units) {
  return variable_text(VariableType::wstring, bytes_of(units, 2 * units.size() + 2));
}

/// The text of what the text was parsed to; the error if it was refused, and then nothing was changed.
std::string again(VariableType type, std::string_view text, std::size_t bytes) {
  Bytes value(bytes, std::byte{0x5a});
  const Bytes before = value;
  const auto parsed = parse_variable(type, text, value);
  if (parsed) return variable_text(type, value);
  EXPECT_EQ(value, before) << text;
  EXPECT_EQ(parsed.error().code, ErrorCode::invalid_argument) << text;
  return "error: " + parsed.error().message;
}
std::string in_wstring(std::string_view text, std::size_t bytes = 20) {
  return again(VariableType::wstring, text, bytes);
}

TEST(Characters, AreBytesInQuotes) {
  const auto is = [](std::string_view text) { return again(VariableType::char_, text, 1); };
  EXPECT_EQ(is("'x'"), "'x'");
  EXPECT_EQ(is("CHAR#'x'"), "'x'");
  EXPECT_EQ(is("char#'$41'"), "'A'");
  EXPECT_EQ(is("'$$'"), "'$$'");
  EXPECT_EQ(is("'$''"), "'$''");
  EXPECT_EQ(is("'\"'"), "'\"'");
  EXPECT_EQ(is("'$N'"), "'$0A'");
  for (const auto* const text : {"", "x", "65", "''", "'xy'", "'x", "'", "\"x\"", "'$4'", "'ü'", "WCHAR#'x'"})
    EXPECT_THAT(is(text), HasSubstr("allowed is")) << text;
  EXPECT_THAT(is("'xy'"), HasSubstr("''xy'' is no CHAR; allowed is one byte, as 'x' or '$41'"));
  for (unsigned code = 0; code < 256; ++code) {
    const Bytes value{static_cast<std::byte>(code)};
    Bytes parsed{std::byte{0x5a}};
    const std::string text = variable_text(VariableType::char_, value);
    ASSERT_TRUE(parse_variable(VariableType::char_, text, parsed)) << text;
    EXPECT_EQ(parsed, value) << text;
  }
  EXPECT_EQ(variable_text(VariableType::char_, {}), "");
}

TEST(WideCharacters, AreUnitsOfUtf16InQuotes) {
  const auto is = [](std::string_view text) { return again(VariableType::wchar, text, 2); };
  EXPECT_EQ(is("\"x\""), "\"x\"");
  EXPECT_EQ(is("WCHAR#\"ü\""), "\"ü\"");
  EXPECT_EQ(is("\"$20AC\""), "\"€\"");
  EXPECT_EQ(is("\"$\"\""), "\"$\"\"");
  EXPECT_EQ(is("\"'\""), "\"'\"");
  EXPECT_EQ(is("\"$0000\""), "\"$0000\"");
  EXPECT_EQ(is("\"$D83D\""), "\"$D83D\"");
  EXPECT_EQ(is("\"$R\""), "\"$000D\"");
  for (const auto* const text :
       {"", "x", "\"\"", "\"xy\"", "'x'", "\"😀\"", "\"$41\"", "\"$004\"", "\"\xfc\""})
    EXPECT_THAT(is(text), HasSubstr("allowed is")) << text;
  EXPECT_THAT(is("\"😀\""), HasSubstr("is no WCHAR; allowed is one unit of UTF-16, as \"x\" or \"$0041\""));
  for (unsigned code = 0; code < 0x10000; ++code) {
    const Bytes value = bytes_of(std::u16string(1, static_cast<char16_t>(code)), 2);
    Bytes parsed(2, std::byte{0x5a});
    const std::string text = variable_text(VariableType::wchar, value);
    ASSERT_TRUE(parse_variable(VariableType::wchar, text, parsed)) << text;
    ASSERT_EQ(parsed, value) << text;
  }
  EXPECT_EQ(variable_text(VariableType::wchar, Bytes(1)), "");
}

TEST(WideStrings, AreShownInUtf8) {
  EXPECT_EQ(text_of(u""), "\"\"");
  EXPECT_EQ(text_of(u"it's \"5\" $"), "\"it's $\"5$\" $$\"");
  EXPECT_EQ(text_of(u"grüß €"), "\"grüß €\"");
  EXPECT_EQ(text_of(u"\U0001f600!"), "\"😀!\"");
  EXPECT_EQ(text_of(u"\U0010fffd"), "\"\U0010fffd\"") << "the last pairs";
  EXPECT_EQ(text_of(u"a\n\x7f\x85z"), "\"a$000A$007F$0085z\"");
  EXPECT_EQ(text_of(units({0xd83d, 'x'})), "\"$D83Dx\"") << "without its second half";
  EXPECT_EQ(text_of(units({0xde00, 0xd83d})), "\"$DE00$D83D\"") << "the wrong way round";
  EXPECT_EQ(text_of(units({0xd83d, 0xd83d, 0xde00})), "\"$D83D😀\"");
  EXPECT_EQ(text_of(units({'a', 0x202e, 'b', 0x200b, 0x2067, 0xfeff, 0x2028, 'c'})),
            "\"a$202Eb$200B$2067$FEFF$2028c\"")
      << "it would be shown in another order, or not at all";
}

TEST(WideStrings, AreReadInEachForm) {
  EXPECT_EQ(in_wstring("\"abc\""), "\"abc\"");
  EXPECT_EQ(in_wstring("WSTRING#\"abc\""), "\"abc\"");
  EXPECT_EQ(in_wstring("abc"), "\"abc\"");
  EXPECT_EQ(in_wstring("WSTRING#abc", 40), "\"WSTRING#abc\"");
  EXPECT_EQ(in_wstring("'a'"), "\"'a'\"");
  EXPECT_EQ(in_wstring("$41"), "\"$$41\"");
  EXPECT_EQ(in_wstring(""), "\"\"");
  EXPECT_EQ(in_wstring("\"grüß €\""), "\"grüß €\"");
  EXPECT_EQ(in_wstring("\"$D83D$DE00\""), "\"😀\"") << "halves make a pair";
  EXPECT_EQ(in_wstring("\"$D83D\""), "\"$D83D\"");
  EXPECT_EQ(in_wstring("\"$L$n$P$r$T$0041$\"\""), "\"$000A$000A$000C$000D$0009A$\"\"");
  EXPECT_EQ(in_wstring("123456789"), "\"123456789\"");
  for (const auto* const text : {"\"", "\"a", "\"a\"b\"", "\"a\"b", "\"$\"", "\"$004\"", "\"$x\"", "\"$'\""})
    EXPECT_THAT(in_wstring(text), HasSubstr("four hexadecimal digits")) << text;
  for (const std::string text : {"\xfc", "\"\xfc\"", "\xc0\x80", "\xe0\x80\x80", "\xed\xa0\x80",
                                 "\xf4\x90\x80\x80", "\xf0\x8f\xbf\xbf", "\xe2\x82", "\xe2\x82x", "\x80"})
    EXPECT_THAT(in_wstring(text), HasSubstr("allowed is UTF-8, as \"text\" with $$, $\""));
  EXPECT_THAT(in_wstring("1234567890"), HasSubstr("a text of at most 9 units of UTF-16; this one has 10"));
  EXPECT_THAT(in_wstring("12345678😀"), HasSubstr("this one has 10"));
  EXPECT_THAT(in_wstring("\"$0000\""), HasSubstr("a text without $0000, which ends a WSTRING"));
}

TEST(WideStrings, EndWithAZeroOrWithTheirMemory) {
  Bytes value(10, std::byte{0xff});
  ASSERT_TRUE(parse_variable(VariableType::wstring, "\"añ\"", value));
  EXPECT_EQ(value, bytes_of(u"añ", 10));
  EXPECT_EQ(variable_text(VariableType::wstring, bytes_of(u"xyz", 6)), "\"xyz\"");
  // Half a unit more is none.
  EXPECT_EQ(variable_text(VariableType::wstring, Bytes(5, std::byte{'x'})), "\"硸硸\"");
  for (std::size_t bytes = 0; bytes < 4; ++bytes) {
    EXPECT_EQ(in_wstring("", bytes), "\"\"") << bytes;
    EXPECT_THAT(in_wstring("a", bytes), HasSubstr("at most 0 units")) << bytes;
  }
  EXPECT_EQ(in_wstring("a", 5), "\"a\"");
}

TEST(WideStrings, OfSizeHaveTheirLengthBehind) {
  constexpr auto kType = VariableType::sized_wstring;
  Bytes value(14, std::byte{0xff});
  ASSERT_TRUE(parse_variable(kType, "\"añc\"", value));
  EXPECT_EQ(value, sized(u"añc", 5));
  EXPECT_EQ(variable_text(kType, value), "\"añc\"");
  EXPECT_EQ(again(kType, "12345", 14), "\"12345\"");
  EXPECT_THAT(again(kType, "123456", 14), HasSubstr("at most 5 units of UTF-16"));
  EXPECT_THAT(again(kType, "\"a$0000b\"", 14), HasSubstr("$0000"));
  EXPECT_EQ(variable_text(kType, sized({u"a\0b", 3}, 5)), "\"a$0000b\"") << "the length counts";
  // A length that is longer than the memory, and memory that has no room for one.
  Bytes longer = sized(u"ab", 2);
  longer.back() = longer[longer.size() - 2] = std::byte{0xff};
  EXPECT_EQ(variable_text(kType, longer), "\"ab\"");
  for (std::size_t bytes = 0; bytes < 6; ++bytes) {
    EXPECT_EQ(variable_text(kType, Bytes(bytes, std::byte{0xff})), "\"\"") << bytes;
    EXPECT_EQ(again(kType, "", bytes), "\"\"") << bytes;
    EXPECT_THAT(again(kType, "a", bytes), HasSubstr("at most 0 units")) << bytes;
  }
  // As many as a variable may have.
  const std::string most(2046, 'x');
  EXPECT_EQ(again(kType, most, 4096).size(), 255U);
  EXPECT_THAT(again(kType, most + "x", 4096), HasSubstr("at most 2046 units of UTF-16; this one has 2047"));
}

TEST(WideStrings, AreCutBetweenTwoCharacters) {
  const Bytes value = bytes_of(u"€€€€", 10);
  EXPECT_EQ(variable_text(VariableType::wstring, value, 14), "\"€€€€\"");
  EXPECT_EQ(variable_text(VariableType::wstring, value, 13), "\"€€€...");
  EXPECT_EQ(variable_text(VariableType::wstring, value, 12), "\"€€...");
}

}  // namespace
}  // namespace plchost
