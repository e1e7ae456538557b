#include <algorithm>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "shm/variables/symbol_page.hpp"
#include "tests/support/own_name.hpp"

namespace plchost {
namespace {

VariableSymbol variable(std::string name, VariableType type = VariableType::int_,
                        std::vector<VariableDimension> dimensions = {}) {
  return {.name = std::move(name),
          .type = type,
          .read_only = false,
          .bytes = is_string(type) ? 81 : traits_of(type).bytes,
          .dimensions = std::move(dimensions),
          .task = {},
          .area = {}};
}

SymbolTable plant() {
  return SymbolTable(
      {variable("Main.speed"), variable("Main.Name", VariableType::string),
       variable("Line.temperature[]", VariableType::real, {{.first = 1, .count = 10}}),
       variable("Grid[][]", VariableType::dint, {{.first = 0, .count = 2}, {.first = -1, .count = 3}}),
       variable("Pump[].speed", VariableType::int_, {{.first = 2, .count = 4}})},
      7);
}

std::string found(const SymbolTable& table, std::string_view name) {
  const auto element = table.find(name);
  if (!element) return element.error().message;
  EXPECT_TRUE(table.has(*element));
  return element_name(table.symbols()[element->symbol], element->element);
}

/// "Main.speed Grid[0,1] Grid[1,1] Pump[].speed:all"
std::string matched(const SymbolTable& table, std::string_view pattern, std::uint32_t from = 0,
                    std::size_t most = kMaxVariables, std::size_t most_elements = kMaxVariables) {
  std::string text;
  for (const auto& match : table.match(pattern, from, most, most_elements)) {
    const VariableSymbol& symbol = table.symbols()[match.symbol];
    if (match.elements.empty()) text += symbol.name + " ";
    for (const auto element : match.elements) text += element_name(symbol, element) + " ";
  }
  if (!text.empty()) text.pop_back();
  return text;
}

TEST(SymbolTable, NamesAreSortedAndFoundWithoutCase) {
  const SymbolTable table = plant();
  EXPECT_EQ(table.symbols()[0].name, "Grid[][]");
  EXPECT_EQ(table.symbols()[2].name, "Main.Name");
  EXPECT_EQ(found(table, "main.SPEED"), "Main.speed");
  EXPECT_EQ(found(table, "Line.temperature[10]"), "Line.temperature[10]");
  EXPECT_EQ(found(table, "grid[1,-1]"), "Grid[1,-1]");
  EXPECT_EQ(found(table, "Grid[1][1]"), "Grid[1,1]");
  EXPECT_EQ(found(table, "Grid[ 0 , 0 ]"), "Grid[0,0]");
  EXPECT_EQ(found(table, "Pump[5].Speed"), "Pump[5].speed");
}

TEST(SymbolTable, OtherNamesAreRefusedWithTheReason) {
  const SymbolTable table = plant();
  EXPECT_EQ(found(table, "main"), "'main' has members; name one, as main.Name");
  EXPECT_EQ(found(table, "Pump[3]"), "'Pump[3]' has members; name one, as Pump[3].speed");
  EXPECT_EQ(found(table, "Pump"), "'Pump' has members; name one, as Pump[2].speed");
  EXPECT_EQ(found(table, "Main.spede"), "no variable 'Main.spede' (did you mean 'Main.speed'?)");
  EXPECT_EQ(found(table, "Elsewhere"), "no variable 'Elsewhere'");
  EXPECT_EQ(found(table, "Line.temperature"),
            "'Line.temperature': it is ARRAY [1..10] OF REAL; name an element, as Line.temperature[1]");
  EXPECT_EQ(found(table, "Grid[1]"),
            "'Grid[1]': it is ARRAY [0..1, -1..1] OF DINT; name an element, as Grid[0,-1]");
  EXPECT_EQ(found(table, "Main.speed[1]"), "'Main.speed[1]': it is INT; name Main.speed");
  EXPECT_EQ(found(table, "Grid[0,2]"),
            "'Grid[0,2]': it is ARRAY [0..1, -1..1] OF DINT; allowed as index 2 are -1 to 1");
  EXPECT_EQ(found(table, "Line.temperature[]"),
            "'Line.temperature[]': it is ARRAY [1..10] OF REAL; allowed as index 1 are 1 to 10");
  for (const auto* const name : {"Grid[x]", "Grid[1", "Grid[99999999999]", "Grid[1.0]", "Grid[1-]"})
    EXPECT_TRUE(found(table, name).ends_with("an index is a number, as in Line.temperature[3] or Grid[1,2]"))
        << name;
  for (const auto* const name : {"", "*", "]", "Main*", "Main.?peed"}) EXPECT_FALSE(table.find(name)) << name;
}

TEST(SymbolTable, ElementsAreCountedByRows) {
  const SymbolTable table = plant();
  for (std::uint32_t element = 0; element < 6; ++element) {
    const auto place = table.find(element_name(table.symbols()[0], element));
    ASSERT_TRUE(place);
    EXPECT_EQ(place->element, element);
  }
  EXPECT_FALSE(table.has({.symbol = 0, .element = 6}));
  EXPECT_FALSE(table.has({.symbol = 5, .element = 0}));
  EXPECT_EQ(type_text(table.symbols()[2]), "STRING[80]");
  EXPECT_EQ(type_text(table.symbols()[0]), "ARRAY [0..1, -1..1] OF DINT");
}

TEST(SymbolTable, PatternsNameVariablesAndElements) {
  const SymbolTable table = plant();
  EXPECT_EQ(matched(table, "*"), "Grid[][] Line.temperature[] Main.Name Main.speed Pump[].speed");
  EXPECT_EQ(matched(table, "MAIN.*"), "Main.Name Main.speed");
  EXPECT_EQ(matched(table, "*.speed"), "Main.speed Pump[].speed");
  EXPECT_EQ(matched(table, "Line.temperature"), "Line.temperature[]");
  EXPECT_EQ(matched(table, "Line.temperature[3]"), "Line.temperature[3]");
  EXPECT_EQ(matched(table, "Line.temperature[*]"), "Line.temperature[]");
  EXPECT_EQ(matched(table, "Grid[1,*]"), "Grid[1,-1] Grid[1,0] Grid[1,1]");
  EXPECT_EQ(matched(table, "Grid[*][0]"), "Grid[0,0] Grid[1,0]");
  EXPECT_EQ(matched(table, "*[2].*"), "Pump[2].speed");
  EXPECT_EQ(matched(table, "*[2]*"), "Line.temperature[2] Pump[2].speed");
  EXPECT_EQ(matched(table, "????.Name"), "Main.Name");
  for (const auto* const none : {"", "Grid[5,0]", "Main", "speed", "[", "Grid[x]", "*[99]"})
    EXPECT_EQ(matched(table, none), "") << none;
}

TEST(SymbolTable, ASearchIsBounded) {
  const SymbolTable table = plant();
  EXPECT_EQ(matched(table, "*", 2, 2), "Main.Name Main.speed");
  EXPECT_EQ(matched(table, "*", 9), "");
  EXPECT_EQ(matched(table, "*[2]*", 0, 9, 1), "Line.temperature[2]");
  EXPECT_EQ(matched(table, "Grid[1,*]", 0, 9, 2), "Grid[1,-1] Grid[1,0]");
  const SymbolTable large(
      {variable("a[]", VariableType::bool_, {{.first = 0, .count = kMaxVariableElements}})}, 1);
  EXPECT_EQ(large.match("a[*]").at(0).elements.size(), 0);
  EXPECT_EQ(large.symbols()[0].elements(), kMaxVariableElements);
}

TEST(SymbolTable, WrongSymbolsAreRefused) {
  const auto is_wrong = [](VariableSymbol symbol) { return !check_symbol(symbol).has_value(); };
  EXPECT_FALSE(is_wrong(variable("a")));
  EXPECT_FALSE(is_wrong(variable(std::string(kMaxVariableName, 'a'))));
  for (const auto* const name : {"", ".", "a.", ".a", "a..b", "[]", "a[", "a]", "a[]b", "a.[]", "a b", "a-b",
                                 "gr\xc3\xbcn", "a*", "a[1]"}) {
    EXPECT_TRUE(is_wrong(variable(name))) << name;
    EXPECT_TRUE(is_wrong(variable(name, VariableType::int_, {{.first = 0, .count = 1}}))) << name;
  }
  EXPECT_TRUE(is_wrong(variable(std::string(kMaxVariableName + 1, 'a'))));
  EXPECT_TRUE(is_wrong(variable("a[]")));
  EXPECT_TRUE(is_wrong(variable("a", VariableType::int_, {{.first = 0, .count = 1}})));
  EXPECT_TRUE(is_wrong(variable("a[]", VariableType::int_, {{.first = 0, .count = 0}})));
  EXPECT_TRUE(
      is_wrong(variable("a[]", VariableType::int_, {{.first = 0, .count = kMaxVariableElements + 1}})));
  EXPECT_TRUE(is_wrong(variable("a[]", VariableType::int_, {{.first = 0x7fffffff, .count = 2}})));
  const VariableDimension half{.first = 0, .count = 5000};
  EXPECT_TRUE(is_wrong(variable("a[][]", VariableType::int_, {half, half})));
  EXPECT_TRUE(is_wrong(variable("a[][][][]", VariableType::int_, {half, half, half, half})));
  VariableSymbol symbol = variable("a");
  symbol.bytes = 4;
  EXPECT_TRUE(is_wrong(symbol));
  symbol = variable("a", VariableType::wchar);
  EXPECT_FALSE(is_wrong(symbol));
  EXPECT_EQ(type_text(symbol), "WCHAR");
  symbol.type = VariableType::char_;
  EXPECT_TRUE(is_wrong(symbol)) << "of 2 bytes";
  symbol = {.name = "a", .type = VariableType::wstring, .bytes = 162};
  EXPECT_FALSE(is_wrong(symbol));
  EXPECT_EQ(type_text(symbol), "WSTRING[80]");
  symbol = {.name = "a[]", .type = VariableType::sized_wstring, .bytes = 164, .dimensions = {{1, 2}}};
  EXPECT_EQ(type_text(symbol), "ARRAY [1..2] OF WSTRING[80]");
  symbol = variable("a", VariableType::string);
  symbol.bytes = kMaxVariableBytes + 1;
  EXPECT_TRUE(is_wrong(symbol));
  symbol = variable("a");
  symbol.type = static_cast<VariableType>(28);
  EXPECT_TRUE(is_wrong(symbol));
  symbol = variable("a");
  symbol.task = std::string(51, 't');
  EXPECT_TRUE(is_wrong(symbol));
  symbol.task = "t";
  symbol.area = std::string(32, 'a');
  EXPECT_TRUE(is_wrong(symbol));
  symbol.area = "a\n";
  EXPECT_TRUE(is_wrong(symbol));
}

class SymbolPageTest : public ::testing::Test {
 protected:
  ~SymbolPageTest() override { SymbolPage::remove(pool_, "line1"); }
  std::string pool_ = own_name("symbols");
};

TEST_F(SymbolPageTest, WhatWasWrittenIsRead) {
  EXPECT_EQ(SymbolTable::open(pool_, "line1").error().code, ErrorCode::not_found);
  const SymbolTable sorted = plant();
  std::vector<VariableSymbol> symbols(sorted.symbols().begin(), sorted.symbols().end());
  symbols[1].task = "Main";
  symbols[1].area = "%QX0.1";
  symbols[1].read_only = true;
  symbols[2].task = "Main";
  const auto page = SymbolPage::create(pool_, "line1", symbols);
  ASSERT_TRUE(page) << page.error().describe();
  const auto table = SymbolTable::open(pool_, "line1");
  ASSERT_TRUE(table) << table.error().describe();
  EXPECT_TRUE(std::ranges::equal(table->symbols(), symbols));
  EXPECT_EQ(table->stream(), page->stream());
  const auto next = SymbolPage::create(pool_, "line1", {});
  ASSERT_TRUE(next);
  EXPECT_GT(next->stream(), page->stream());
  EXPECT_TRUE(SymbolTable::open(pool_, "line1")->symbols().empty());
  SymbolPage::remove(pool_, "line1");
  EXPECT_FALSE(SymbolTable::open(pool_, "line1"));
}

TEST_F(SymbolPageTest, AsManyAsThereMayBe) {
  std::vector<VariableSymbol> symbols;
  for (std::size_t i = 0; i < kMaxVariables; ++i) symbols.push_back(variable(fmt::format("v{:05}", i)));
  ASSERT_TRUE(SymbolPage::create(pool_, "line1", symbols));
  const auto table = SymbolTable::open(pool_, "line1");
  ASSERT_TRUE(table);
  EXPECT_EQ(table->symbols().size(), kMaxVariables);
  EXPECT_EQ(table->find("V65535")->symbol, kMaxVariables - 1);
  symbols.push_back(variable("w"));
  EXPECT_EQ(SymbolPage::create(pool_, "line1", symbols).error().code, ErrorCode::full);
}

TEST_F(SymbolPageTest, EachByteOfAStrangerIsRefusedOrHarmless) {
  const SymbolTable table = plant();
  const std::vector<VariableSymbol> symbols(table.symbols().begin(), table.symbols().end());
  ASSERT_TRUE(SymbolPage::create(pool_, "line1", symbols));
  const auto memory =
      MemoryFile::open(symbol_page_name(pool_, "line1"), 1, MemoryFile::Access::read_only).value();
  std::vector<std::byte> page(memory.bytes().begin(), memory.bytes().end());
  ASSERT_TRUE(SymbolTable::parse("p", page));
  std::size_t refused = 0;
  for (std::byte& byte : page) {
    for (const unsigned value : {0x00U, 0x01U, 0x7fU, 0x80U, 0xffU}) {
      const std::byte before = std::exchange(byte, std::byte(value));
      const auto parsed = SymbolTable::parse("p", page);
      if (!parsed) {
        ++refused;
        EXPECT_EQ(parsed.error().code, ErrorCode::corrupt);
      }
      byte = before;
    }
  }
  EXPECT_GT(refused, 5 * 32 - 40);
  for (std::size_t size = 0; size < page.size(); ++size)
    EXPECT_FALSE(SymbolTable::parse("p", std::span(page).first(size)));
}

TEST_F(SymbolPageTest, AFileThatIsNoneIsRefused) {
  ASSERT_TRUE(MemoryFile::create(symbol_page_name(pool_, "line1"), 4096));
  EXPECT_EQ(SymbolTable::open(pool_, "line1").error().code, ErrorCode::corrupt);
  // And no obstacle for the instance.
  EXPECT_TRUE(SymbolPage::create(pool_, "line1", {}));
  EXPECT_TRUE(SymbolTable::open(pool_, "line1"));
}

}  // namespace
}  // namespace plchost
