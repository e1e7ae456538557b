#include "shm/variables/variable_type.hpp"

#include <array>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "instances/plc_variables.h"

namespace plchost {
namespace {

using Bytes = std::vector<std::byte>;

template <class Value>
Bytes bytes_of(Value value) {
  Bytes bytes(sizeof value);
  std::memcpy(bytes.data(), &value, sizeof value);
  return bytes;
}

Bytes spec(std::int64_t seconds, std::int64_t nanoseconds) {
  return bytes_of(std::array{seconds, nanoseconds});
}

Bytes text_memory(std::string_view text, std::size_t bytes) {
  Bytes memory(bytes);
  std::memcpy(memory.data(), text.data(), text.size());
  return memory;
}

std::size_t size_of(VariableType type) {
  return is_string(type) ? 10 : traits_of(type).bytes;
}

/// The text of what the text was parsed to; "error: ..." if it was refused, and then nothing was changed.
std::string again(VariableType type, std::string_view text) {
  Bytes value(size_of(type), std::byte{0x5a});
  const Bytes before = value;
  if (const auto parsed = parse_variable(type, text, value); !parsed) {
    EXPECT_EQ(value, before) << text;
    EXPECT_EQ(parsed.error().code, ErrorCode::invalid_argument) << text;
    return "error: " + parsed.error().message;
  }
  return variable_text(type, value);
}

void expect_refused(VariableType type, std::initializer_list<std::string_view> texts) {
  for (const std::string_view text : texts)
    EXPECT_TRUE(again(type, text).starts_with("error: "))
        << traits_of(type).name << " '" << text << "' gave " << again(type, text);
}

TEST(VariableType, NumbersAreThoseOfTheCInterface) {
  EXPECT_EQ(variable_types().size(), PLC_TYPE_SIZED_WSTRING);
  std::uint32_t number = 1;
  for (const VariableTypeTraits& type : variable_types()) {
    EXPECT_EQ(std::to_underlying(type.type), number);
    EXPECT_EQ(find_variable_type(number), &type);
    EXPECT_EQ(&traits_of(type.type), &type);
    ++number;
  }
  EXPECT_EQ(find_variable_type(0), nullptr);
  EXPECT_EQ(find_variable_type(number), nullptr);
  EXPECT_EQ(std::to_underlying(VariableType::bool_), PLC_TYPE_BOOL);
  EXPECT_EQ(std::to_underlying(VariableType::lword), PLC_TYPE_LWORD);
  EXPECT_EQ(std::to_underlying(VariableType::date_and_time), PLC_TYPE_DATE_AND_TIME);
  EXPECT_EQ(std::to_underlying(VariableType::string), PLC_TYPE_STRING);
  EXPECT_EQ(std::to_underlying(VariableType::timespec_time), PLC_TYPE_TIMESPEC_TIME);
  EXPECT_EQ(std::to_underlying(VariableType::char_), PLC_TYPE_CHAR);
  EXPECT_EQ(std::to_underlying(VariableType::wchar), PLC_TYPE_WCHAR);
  EXPECT_EQ(std::to_underlying(VariableType::wstring), PLC_TYPE_WSTRING);
}

template <class Value>
void expect_integer(VariableType type) {
  using Limits = std::numeric_limits<Value>;
  const auto of = [](auto number) { return std::to_string(number); };
  for (const Value value :
       {Limits::min(), Limits::max(), Value{0}, Value{1}, static_cast<Value>(Limits::max() / 3)}) {
    EXPECT_EQ(variable_text(type, bytes_of(value)), of(value));
    Bytes parsed(sizeof(Value));
    ASSERT_TRUE(parse_variable(type, of(value), parsed));
    EXPECT_EQ(parsed, bytes_of(value));
  }
  // One more than the highest, one less than the lowest: of digits, as no type is wide enough for all.
  std::string above = of(Limits::max());
  ++above.back();
  std::string below = of(Limits::min());
  if (below == "0") below = "-0";
  ++below.back();
  expect_refused(type, {above, below,  "",    "-",   "+",   "1.5",  "x",   "0x10", "1 ",    " 1",  "_1",
                        "1_",  "1__0", "3#1", "2#2", "8#8", "16#G", "16#", "#1",   "16#-1", "--1", "+-1"});
  EXPECT_TRUE(again(type, above).find(of(Limits::max())) != std::string::npos) << again(type, above);
}

TEST(VariableType, IntegersHaveTheirRange) {
  expect_integer<std::int8_t>(VariableType::sint);
  expect_integer<std::int16_t>(VariableType::int_);
  expect_integer<std::int32_t>(VariableType::dint);
  expect_integer<std::int64_t>(VariableType::lint);
  expect_integer<std::uint8_t>(VariableType::usint);
  expect_integer<std::uint16_t>(VariableType::uint);
  expect_integer<std::uint32_t>(VariableType::udint);
  expect_integer<std::uint64_t>(VariableType::ulint);
}

TEST(VariableType, IntegersHaveEachBaseAndThePrefixOfTheirType) {
  EXPECT_EQ(again(VariableType::int_, "2#1010"), "10");
  EXPECT_EQ(again(VariableType::int_, "8#17"), "15");
  EXPECT_EQ(again(VariableType::int_, "16#7f_ff"), "32767");
  EXPECT_EQ(again(VariableType::int_, "10#12"), "12");
  EXPECT_EQ(again(VariableType::int_, "+1_000"), "1000");
  EXPECT_EQ(again(VariableType::int_, "INT#-5"), "-5");
  EXPECT_EQ(again(VariableType::int_, "int#16#10"), "16");
  expect_refused(VariableType::int_, {"DINT#5", "16#8000", "INT#", "INT#INT#5"});
}

TEST(VariableType, BitStringsAreHexadecimal) {
  EXPECT_EQ(variable_text(VariableType::byte, bytes_of(std::uint8_t{10})), "16#0A");
  EXPECT_EQ(variable_text(VariableType::word, bytes_of(std::uint16_t{255})), "16#00FF");
  EXPECT_EQ(variable_text(VariableType::dword, bytes_of(std::uint32_t{0xdeadbeef})), "16#DEADBEEF");
  EXPECT_EQ(variable_text(VariableType::lword, bytes_of(~std::uint64_t{0})), "16#FFFFFFFFFFFFFFFF");
  for (const auto type : {VariableType::byte, VariableType::word, VariableType::dword, VariableType::lword}) {
    const std::string text = variable_text(type, Bytes(traits_of(type).bytes, std::byte{0xa5}));
    EXPECT_EQ(again(type, text), text);
    expect_refused(type, {"-1", "TRUE", "16#1" + std::string(2 * size_of(type), '0')});
  }
  EXPECT_EQ(again(VariableType::byte, "255"), "16#FF");
  EXPECT_EQ(again(VariableType::word, "WORD#2#1111_0000"), "16#00F0");
}

TEST(VariableType, Bools) {
  for (const auto* const text : {"TRUE", "true", "1", "BOOL#TRUE", "BOOL#1"})
    EXPECT_EQ(again(VariableType::bool_, text), "TRUE");
  for (const auto* const text : {"FALSE", "False", "0"}) EXPECT_EQ(again(VariableType::bool_, text), "FALSE");
  EXPECT_EQ(variable_text(VariableType::bool_, bytes_of(std::uint8_t{77})), "TRUE");
  expect_refused(VariableType::bool_, {"", "2", "yes", "TRUE "});
}

TEST(VariableType, RealsComeBackTheSame) {
  for (const double value : {0.0, 1.0, -1.5, 0.1, 1e300, 5e-324, std::numeric_limits<double>::max(),
                             std::numeric_limits<double>::infinity(), -0.0}) {
    Bytes parsed(sizeof value);
    const std::string text = variable_text(VariableType::lreal, bytes_of(value));
    ASSERT_TRUE(parse_variable(VariableType::lreal, text, parsed)) << text;
    EXPECT_EQ(parsed, bytes_of(value)) << text;
  }
  EXPECT_EQ(variable_text(VariableType::lreal, bytes_of(2.0)), "2.0");
  EXPECT_EQ(variable_text(VariableType::lreal, bytes_of(1e30)), "1.0e+30");
  EXPECT_EQ(variable_text(VariableType::real, bytes_of(0.1F)), "0.1");
  EXPECT_EQ(again(VariableType::real, "REAL#1_000.5"), "1000.5");
  EXPECT_EQ(again(VariableType::real, "+2"), "2.0");
  EXPECT_EQ(again(VariableType::real, "nan"), "nan");
  EXPECT_EQ(again(VariableType::real, "1e3"), "1000.0");
  expect_refused(VariableType::real, {"", "1e39", "1,5", "1.5x", "16#10", "+-1", "TRUE", "1e"});
  expect_refused(VariableType::lreal, {"1e309", "0x10"});
}

TEST(VariableType, DurationsHaveEachUnit) {
  const auto text = [](std::int64_t value) { return variable_text(VariableType::time, bytes_of(value)); };
  EXPECT_EQ(text(0), "T#0s");
  EXPECT_EQ(text(1), "T#1ns");
  EXPECT_EQ(text(-1'500'000'000), "T#-1s500ms");
  EXPECT_EQ(text(93'784'005'006'007), "T#1d2h3m4s5ms6us7ns");
  EXPECT_EQ(text(std::numeric_limits<std::int64_t>::max()), "T#106751d23h47m16s854ms775us807ns");
  EXPECT_EQ(text(std::numeric_limits<std::int64_t>::min()), "T#-106751d23h47m16s854ms775us808ns");
  for (const std::int64_t value :
       {std::numeric_limits<std::int64_t>::max(), std::numeric_limits<std::int64_t>::min(),
        std::int64_t{1'000'000'007}, std::int64_t{-7}})
    EXPECT_EQ(again(VariableType::time, text(value)), text(value));
}

TEST(VariableType, DurationsAreReadInEachForm) {
  const auto is = [](std::string_view text) { return again(VariableType::time, text); };
  EXPECT_EQ(is("T#1d2h3m4s5ms6us7ns"), "T#1d2h3m4s5ms6us7ns");
  EXPECT_EQ(is("TIME#-2.5ms"), "T#-2ms500us");
  EXPECT_EQ(is("ltime#1H_30M"), "T#1h30m");
  EXPECT_EQ(is("1.5s"), "T#1s500ms");
  EXPECT_EQ(is("T#0.5d"), "T#12h");
  EXPECT_EQ(is("T#90s"), "T#1m30s");
  EXPECT_EQ(is("T#+1_000ms"), "T#1s");
  expect_refused(VariableType::time,
                 {"", "T#", "5", "T#5", "T#-", "T#1x", "T#1s2", "T#.5s", "T#1.s", "T#1.2.3s", "T#--1s",
                  "T#1s-2ms", "D#1s", "T#106752d", "T#106751d23h47m16s854ms775us808ns",
                  "T#-106751d23h47m16s854ms775us809ns", "T#99999999999999999999s", "T#1 s"});
}

TEST(VariableType, DatesAreOfTheProlepticCalendarInUtc) {
  EXPECT_EQ(again(VariableType::date, "D#2026-11-25"), "D#2026-11-25");
  EXPECT_EQ(again(VariableType::date, "2024-02-29"), "D#2024-02-29");
  EXPECT_EQ(again(VariableType::date, "DATE#1969-12-31"), "D#1969-12-31");
  Bytes day(8);
  ASSERT_TRUE(parse_variable(VariableType::date, "D#1970-01-02", day));
  EXPECT_EQ(day, bytes_of(std::int64_t{86'400'000'000'000}));
  EXPECT_EQ(variable_text(VariableType::date, bytes_of(std::numeric_limits<std::int64_t>::min())),
            "D#1677-09-21");
  expect_refused(VariableType::date,
                 {"", "D#2023-02-29", "D#2026-13-01", "D#2026-00-01", "D#2026-1-1", "D#1677-01-01",
                  "D#2262-01-01", "D#2026-11-25-12:00:00", "T#1s", "today"});
  EXPECT_EQ(again(VariableType::date, "D#2262-01-01"),
            "error: '2262-01-01' is not a date; allowed is D#2026-11-25, with a year from 1678 to 2261");
}

TEST(VariableType, TimesOfDay) {
  EXPECT_EQ(again(VariableType::time_of_day, "TOD#12:30:00"), "TOD#12:30:00");
  EXPECT_EQ(again(VariableType::time_of_day, "TIME_OF_DAY#23:59:59.999999999"), "TOD#23:59:59.999999999");
  EXPECT_EQ(again(VariableType::time_of_day, "00:00:00.5"), "TOD#00:00:00.5");
  EXPECT_EQ(variable_text(VariableType::time_of_day, bytes_of(std::int64_t{-1})), "-1");
  EXPECT_EQ(variable_text(VariableType::time_of_day, bytes_of(std::int64_t{86'400'000'000'000})),
            "86400000000000");
  expect_refused(VariableType::time_of_day, {"24:00:00", "12:60:00", "12:00:60", "12:00", "1:00:00",
                                             "12:00:00.", "12:00:00.1234567890"});
}

TEST(VariableType, DatesAndTimes) {
  EXPECT_EQ(again(VariableType::date_and_time, "DT#2026-11-25-12:30:00"), "DT#2026-11-25-12:30:00");
  EXPECT_EQ(again(VariableType::date_and_time, "1969-12-31-23:59:59.25"), "DT#1969-12-31-23:59:59.25");
  EXPECT_EQ(variable_text(VariableType::date_and_time, bytes_of(std::int64_t{-1})),
            "DT#1969-12-31-23:59:59.999999999");
  EXPECT_EQ(variable_text(VariableType::date_and_time, bytes_of(std::numeric_limits<std::int64_t>::max())),
            "DT#2262-04-11-23:47:16.854775807");
  expect_refused(VariableType::date_and_time, {"2026-11-25", "2026-11-25 12:30:00", "2026-11-25-24:00:00"});
}

TEST(VariableType, TimesOfCompilersHaveSecondsAndNanoseconds) {
  Bytes value(16);
  ASSERT_TRUE(parse_variable(VariableType::timespec_time, "T#-1s500ms", value));
  EXPECT_EQ(value, spec(-1, -500'000'000));
  EXPECT_EQ(variable_text(VariableType::timespec_time, spec(1, 5)), "T#1s5ns");
  EXPECT_EQ(variable_text(VariableType::timespec_time, spec(-2, 500'000'000)), "T#-1s500ms");
  EXPECT_EQ(variable_text(VariableType::timespec_time, spec(std::numeric_limits<std::int64_t>::max(), 1)),
            "9223372036854775807 s 1 ns");
  EXPECT_EQ(again(VariableType::timespec_date, "D#2026-11-25"), "D#2026-11-25");
  EXPECT_EQ(again(VariableType::timespec_time_of_day, "TOD#01:02:03.004"), "TOD#01:02:03.004");
  EXPECT_EQ(again(VariableType::timespec_date_and_time, "DT#1969-12-31-23:59:59.25"),
            "DT#1969-12-31-23:59:59.25");
}

TEST(VariableType, StringsHaveEscapes) {
  const auto text = [](std::string_view of) {
    return variable_text(VariableType::string, text_memory(of, 20));
  };
  EXPECT_EQ(text(""), "''");
  EXPECT_EQ(text("it's $5"), "'it$'s $$5'");
  EXPECT_EQ(text("a\nb\x7f"), "'a$0Ab$7F'");
  EXPECT_EQ(text("gr\xc3\xbc\xc3\x9f"), "'gr\xc3\xbc\xc3\x9f'");
  EXPECT_EQ(text("gr\xfc"), "'gr$FC'");
  // Without an end it ends with its memory.
  EXPECT_EQ(variable_text(VariableType::string, Bytes(3, std::byte{'x'})), "'xxx'");
  for (int c = 1; c < 256; ++c) {
    const std::string one(1, static_cast<char>(c));
    Bytes parsed(20, std::byte{0xff});
    ASSERT_TRUE(parse_variable(VariableType::string, text(one), parsed)) << text(one);
    EXPECT_EQ(parsed, text_memory(one, 20));
  }
}

TEST(VariableType, StringsAreReadInEachForm) {
  const auto is = [](std::string_view text) { return again(VariableType::string, text); };
  EXPECT_EQ(is("plain"), "'plain'");
  EXPECT_EQ(is(""), "''");
  EXPECT_EQ(is("''"), "''");
  EXPECT_EQ(is("STRING#'a'"), "'a'");
  EXPECT_EQ(is("STRING#a"), "'STRING#a'");
  EXPECT_EQ(is("'$L$n$P$r$T$41'"), "'$0A$0A$0C$0D$09A'");
  EXPECT_EQ(is("$41"), "'$$41'");
  EXPECT_EQ(is("123456789"), "'123456789'");
  expect_refused(VariableType::string,
                 {"1234567890", "'", "'a", "'a'b'", "'a'b", "'$'", "'$4'", "'$x'", "'$00'"});
}

TEST(VariableType, CountedStringsHaveTheirLengthInFront) {
  Bytes value(10, std::byte{0xff});
  ASSERT_TRUE(parse_variable(VariableType::counted_string, "'a$00b'", value));
  EXPECT_EQ(value, text_memory(std::string_view("\3a\0b", 4), 10));
  EXPECT_EQ(variable_text(VariableType::counted_string, value), "'a$00b'");
  EXPECT_EQ(again(VariableType::counted_string, "123456789"), "'123456789'");
  expect_refused(VariableType::counted_string, {"1234567890"});
  // A length that is longer than the memory.
  EXPECT_EQ(variable_text(VariableType::counted_string, text_memory("\xffxyz", 4)), "'xyz'");
  Bytes large(400);
  ASSERT_TRUE(parse_variable(VariableType::counted_string, std::string(255, 'x'), large));
  EXPECT_FALSE(parse_variable(VariableType::counted_string, std::string(256, 'x'), large));
}

TEST(VariableType, SizedStringsHaveTheirLengthBehind) {
  Bytes value(10, std::byte{0xff});
  ASSERT_TRUE(parse_variable(VariableType::sized_string, "'abc'", value));
  EXPECT_EQ(value, text_memory(std::string_view("abc\0\0\0\0\0\3\0", 10), 10));
  EXPECT_EQ(variable_text(VariableType::sized_string, value), "'abc'");
  EXPECT_EQ(again(VariableType::sized_string, "123456"), "'123456'");
  expect_refused(VariableType::sized_string, {"1234567", "'a$00b'"});
  // A length that is longer than the memory, and memory that has no room for one.
  EXPECT_EQ(variable_text(VariableType::sized_string, text_memory("abc\xff\xff", 5)), "'ab'");
  EXPECT_EQ(variable_text(VariableType::sized_string, text_memory("abc", 3)), "''");
  Bytes small(3);
  EXPECT_TRUE(parse_variable(VariableType::sized_string, "", small));
  EXPECT_FALSE(parse_variable(VariableType::sized_string, "a", small));
}

TEST(VariableType, DatesInDaysAreDates) {
  Bytes value(8);
  ASSERT_TRUE(parse_variable(VariableType::days_date, "D#1970-01-11", value));
  EXPECT_EQ(value[0], std::byte{10});
  EXPECT_EQ(again(VariableType::days_date, "D#2026-11-25"), "D#2026-11-25");
  EXPECT_EQ(again(VariableType::days_date, "1969-12-31"), "D#1969-12-31");
  expect_refused(VariableType::days_date, {"10", "D#2026-11-25-12:30:00"});
  std::ranges::fill(value, std::byte{0x7f});
  EXPECT_EQ(variable_text(VariableType::days_date, value), "9187201950435737471");
}

TEST(VariableType, ALongTextIsCut) {
  const Bytes value = text_memory("0123456789", 20);
  EXPECT_EQ(variable_text(VariableType::string, value, 12), "'0123456789'");
  EXPECT_EQ(variable_text(VariableType::string, value, 11), "'0123456...");
  EXPECT_EQ(variable_text(VariableType::string, value, 2), "..");
}

TEST(VariableType, OtherSizesAreRefused) {
  Bytes value(3);
  const auto parsed = parse_variable(VariableType::int_, "1", value);
  ASSERT_FALSE(parsed);
  EXPECT_EQ(parsed.error().code, ErrorCode::wrong_size);
  EXPECT_EQ(variable_text(VariableType::int_, std::span(value).first(1)), "");
}

}  // namespace
}  // namespace plchost
