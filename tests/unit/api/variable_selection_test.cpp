#include "api/server/lists/variable_selection.hpp"

#include <cstring>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>

#include "api/dds/text.hpp"

namespace plchost {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::StartsWith;

SymbolTable table_of(std::vector<VariableSymbol> symbols) {
  return {std::move(symbols), 7};
}

VariableSymbol number(std::string name, std::vector<VariableDimension> dimensions = {}) {
  return {.name = std::move(name),
          .type = VariableType::int_,
          .read_only = false,
          .bytes = 2,
          .dimensions = std::move(dimensions),
          .task = "Fast",
          .area = ""};
}

// Sorted by name without regard to case.
SymbolTable plant() {
  return table_of({number("Grid[][]", {{1, 2}, {0, 3}}), number("line.speed"), number("Line.stop"),
                   number("pump[].speed", {{1, 300}}), number("Pumps")});
}

// Values that count up from 0, in the order of the elements.
ValueReply values_of(const std::vector<VariableElement>& elements, std::int16_t first = 0) {
  ValueReply reply{.elements = elements, .forced = std::vector<std::uint8_t>(elements.size()), .values = {}};
  for (std::size_t i = 0; i < elements.size(); ++i) {
    const auto value = static_cast<std::int16_t>(first + static_cast<std::int16_t>(i));
    const auto* const bytes = reinterpret_cast<const std::byte*>(&value);
    reply.values.insert(reply.values.end(), bytes, bytes + sizeof value);
  }
  return reply;
}

std::vector<std::string> names_of(const SymbolTable& table, const VariableQuery& query) {
  const auto selection = select_variables(table, query);
  EXPECT_TRUE(selection) << selection.error().message;
  std::vector<std::string> names;
  for (const auto& record : records_of(table, *selection, values_of(selection->elements), {})) {
    names.emplace_back(dds::text_of(record.name));
  }
  return names;
}

TEST(VariableSelection, IsOfAllVariablesWithoutAPattern) {
  EXPECT_THAT(names_of(plant(), {}),
              ElementsAre("Grid[][]", "line.speed", "Line.stop", "pump[].speed", "Pumps"));
}

TEST(VariableSelection, NamesElementsAndWholeVariablesEachOnce) {
  EXPECT_THAT(names_of(plant(), {.patterns = {"LINE.*", "line.speed", "grid[2,1]", "Pump[300].speed"}}),
              ElementsAre("Grid[2,1]", "line.speed", "Line.stop", "pump[300].speed"));
  EXPECT_THAT(names_of(plant(), {.patterns = {"Grid[*,*]"}}),
              ElementsAre("Grid[1,0]", "Grid[1,1]", "Grid[1,2]", "Grid[2,0]", "Grid[2,1]", "Grid[2,2]"));
  EXPECT_THAT(names_of(plant(), {.patterns = {"Grid"}}), ElementsAre("Grid[][]"));
  EXPECT_THAT(names_of(plant(), {.patterns = {"nothing*"}}), ElementsAre());
}

// "Grid[1,2]" is one of them.
std::vector<std::string> examples_in(const std::string& file) {
  std::ifstream stream(std::string(API) + "/" + file);
  const std::string text{std::istreambuf_iterator<char>(stream), {}};
  std::vector<std::string> examples;
  for (std::size_t at = text.find("Grid["); at != std::string::npos; at = text.find("Grid[", at + 1))
    examples.push_back(text.substr(at, text.find(']', at) + 1 - at));
  return examples;
}

TEST(VariableSelection, TakesTheExamplesOfItsDocuments) {
  for (const char* const file :
       {"control.idl", "plchost_client.hpp", "plcctl.md", "cli/verbs/variable_sampler.hpp"}) {
    const std::vector<std::string> examples = examples_in(file);
    EXPECT_FALSE(examples.empty()) << file;
    for (const std::string& example : examples) {
      const auto selection = select_variables(plant(), {.patterns = {example}});
      EXPECT_TRUE(selection && !selection->elements.empty()) << file << ": " << example;
    }
  }
}

TEST(VariableSelection, RefusesANameThatIsNoVariable) {
  const auto unknown = select_variables(plant(), {.patterns = {"Line.sped"}});
  ASSERT_FALSE(unknown);
  EXPECT_EQ(unknown.error().code, ErrorCode::not_found);
  EXPECT_THAT(unknown.error().message, HasSubstr("line.speed"));
  EXPECT_FALSE(select_variables(plant(), {.patterns = {"Grid[3,0]"}}));
  EXPECT_FALSE(select_variables(plant(), {.patterns = {"Grid[1]"}}));
  EXPECT_FALSE(select_variables(plant(), {.patterns = {"Grid[1,0"}}));
  for (const char* const wrong : {"Grid[1?,0]", "*[x]", "Gr*[1,0", "Grid[0*]"}) {
    const auto refused = select_variables(plant(), {.patterns = {wrong}});
    ASSERT_FALSE(refused) << wrong;
    EXPECT_EQ(refused.error().code, ErrorCode::invalid_argument);
    EXPECT_THAT(refused.error().message, HasSubstr("an index is a number"));
  }
}

TEST(VariableSelection, HasABoundOfPatternsThatAreLookedForEverywhere) {
  VariableQuery query{.patterns = std::vector<std::string>(kMaxWildcards, "*")};
  EXPECT_TRUE(select_variables(plant(), query));
  query.patterns.emplace_back("?");
  const auto refused = select_variables(plant(), query);
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("more than 16 patterns"));
}

TEST(VariableSelection, GoesOnWhereThePageBeforeHasEnded) {
  std::vector<VariableSymbol> many;
  for (int i = 0; i < 3000; ++i) many.push_back(number(fmt::format("v{:04}", i)));
  const SymbolTable table = table_of(many);
  for (const VariableQuery& asked : {VariableQuery{}, VariableQuery{.patterns = {"v*"}}}) {
    VariableQuery query = asked;
    std::vector<std::string> all;
    for (bool complete = false; !complete;) {
      const auto page = select_variables(table, query);
      ASSERT_TRUE(page);
      ASSERT_LE(page->rows.size(), kPageVariables);
      for (const SelectedVariable& row : page->rows) all.push_back(table.symbols()[row.symbol].name);
      complete = page->complete;
      ASSERT_TRUE(complete || page->next_after > query.after);
      query.after = page->next_after;
    }
    ASSERT_EQ(all.size(), many.size());
    for (std::size_t i = 0; i < many.size(); ++i) ASSERT_EQ(all[i], many[i].name);
  }
}

TEST(VariableSelection, GoesOnWithinAnArrayWhoseElementsAreNamed) {
  const SymbolTable table = table_of({number("big[]", {{0, 2500}}), number("last")});
  VariableQuery query{.patterns = {"big[*]", "last"}};
  std::size_t rows = 0;
  for (bool complete = false; !complete;) {
    const auto page = select_variables(table, query);
    ASSERT_TRUE(page);
    rows += page->rows.size();
    complete = page->complete;
    ASSERT_TRUE(complete || page->next_after > query.after);
    query.after = page->next_after;
  }
  EXPECT_EQ(rows, 2501U);
}

TEST(VariableSelection, AsksForNoMoreThanOneSampleHolds) {
  std::vector<VariableSymbol> texts;
  for (int i = 0; i < 600; ++i) {
    VariableSymbol text = number(fmt::format("t{:03}", i));
    text.type = VariableType::string;
    text.bytes = kMaxVariableBytes;
    texts.push_back(text);
  }
  const auto page = select_variables(table_of(texts), {});
  ASSERT_TRUE(page);
  EXPECT_FALSE(page->complete);
  EXPECT_GT(page->rows.size(), 0U);
  EXPECT_LE(page->rows.size() * kMaxVariableBytes, kMaxValueBytes);
}

VariableSymbol texts_of_bytes(std::string name, std::uint32_t bytes, std::uint32_t count) {
  VariableSymbol texts = number(std::move(name), {{0, count}});
  texts.type = VariableType::string;
  texts.bytes = bytes;
  return texts;
}

// Each row fits into an empty page, so a page goes on behind the one before.
TEST(VariableSelection, ShowsOfAnArrayOfLongTextsAsManyAsOneSampleHolds) {
  const SymbolTable table = table_of({texts_of_bytes("few[]", 255, 64), texts_of_bytes("long[]", 1537, 64),
                                      texts_of_bytes("most[]", kMaxVariableBytes, 25), number("speed")});
  EXPECT_THAT(names_of(table, {}), ElementsAre("few[]", "long[]", "most[]", "speed"));
  EXPECT_THAT(names_of(table, {.patterns = {"MOST"}}), ElementsAre("most[]"));
  EXPECT_THAT(names_of(table, {.patterns = {"*o*"}}), ElementsAre("long[]", "most[]"));
  const auto page = select_variables(table, {});
  ASSERT_TRUE(page);
  EXPECT_TRUE(page->complete);
  ASSERT_EQ(page->rows.size(), 4U);
  EXPECT_EQ(page->rows[0].count, 64U);
  EXPECT_EQ(page->rows[1].count, 10U);
  EXPECT_EQ(page->rows[2].count, 4U);
}

TEST(VariableRecords, ShowValuesTypesAndTasks) {
  const SymbolTable table = plant();
  const auto selection = select_variables(table, {.patterns = {"Grid", "Grid[2,0]", "line.speed"}});
  ASSERT_TRUE(selection);
  const auto records = records_of(table, *selection, values_of(selection->elements), {});
  ASSERT_EQ(records.size(), 3U);
  EXPECT_EQ(dds::text_of(records[0].value), "[0, 1, 2, 3, 4, 5]");
  EXPECT_EQ(dds::text_of(records[0].type), "ARRAY [1..2, 0..2] OF INT");
  EXPECT_EQ(dds::text_of(records[1].name), "Grid[2,0]");
  EXPECT_EQ(dds::text_of(records[1].value), "6");
  EXPECT_EQ(dds::text_of(records[1].type), "INT");
  EXPECT_EQ(dds::text_of(records[2].value), "7");
  EXPECT_EQ(dds::text_of(records[2].task), "Fast");
}

TEST(VariableRecords, CutALongArrayAndSaySo) {
  const SymbolTable table = plant();
  const auto selection = select_variables(table, {.patterns = {"pump.speed"}});
  ASSERT_TRUE(selection);
  const auto records = records_of(table, *selection, values_of(selection->elements, 20000), {});
  ASSERT_EQ(records.size(), 1U);
  const std::string value(dds::text_of(records[0].value));
  EXPECT_THAT(value, StartsWith("[20000, 20001, "));
  EXPECT_TRUE(value.ends_with("...")) << value;
  EXPECT_LE(value.size(), 1023U);
}

// The rest of the array is not asked for, so the row says that there is more.
TEST(VariableRecords, SayThatAnArrayOfLongTextsIsNotWhole) {
  const SymbolTable table = table_of({texts_of_bytes("most[]", kMaxVariableBytes, 25)});
  const auto page = select_variables(table, {});
  ASSERT_TRUE(page);
  ValueReply reply{.elements = page->elements, .forced = {}, .values = {}};
  reply.values.assign(page->elements.size() * kMaxVariableBytes, std::byte{0});
  const auto records = records_of(table, *page, reply, {});
  ASSERT_EQ(records.size(), 1U);
  EXPECT_EQ(dds::text_of(records[0].value), "['', '', '', ''...");
}

VariableSymbol text_of_bytes(std::string name, std::uint32_t bytes) {
  VariableSymbol text = number(std::move(name));
  text.type = VariableType::string;
  text.bytes = bytes;
  return text;
}

// The largest text of IEC 61131-3's usual STRING[254], and one of all the memory that a string may have.
TEST(VariableRecords, ShowALongTextWholeAndSayThatALongerOneIsCut) {
  const SymbolTable table = table_of({text_of_bytes("a", 255), text_of_bytes("b", kMaxVariableBytes)});
  const auto selection = select_variables(table, {});
  ASSERT_TRUE(selection);
  ValueReply reply{.elements = selection->elements, .forced = {0, 0}, .values = {}};
  reply.values.assign(255 + kMaxVariableBytes, std::byte{'x'});
  reply.values[254] = std::byte{0};
  const auto records = records_of(table, *selection, reply, reply);
  ASSERT_EQ(records.size(), 2U);
  const std::string whole = "'" + std::string(254, 'x') + "'";
  EXPECT_EQ(dds::text_of(records[0].value), whole);
  EXPECT_EQ(dds::text_of(records[0].forced_value), whole);
  const std::string cut = "'" + std::string(1019, 'x') + "...";
  EXPECT_EQ(dds::text_of(records[1].value), cut);
  EXPECT_EQ(dds::text_of(records[1].forced_value), cut);
}

// The bytes of records as they travel: each text has a length and a zero, and begins at a multiple of 4.
std::size_t bytes_of(const std::vector<plc_VariableRecord>& records) {
  std::size_t bytes = 0;
  const auto add = [&bytes](std::string_view text) { bytes += (4 + text.size() + 1 + 3) / 4 * 4; };
  for (const plc_VariableRecord& record : records) {
    add(dds::text_of(record.name));
    add(dds::text_of(record.type));
    add(dds::text_of(record.task));
    add(dds::text_of(record.area));
    add(dds::text_of(record.value));
    add(dds::text_of(record.forced_value));
    bytes += 8;  // truths, and the length of ext
  }
  return bytes;
}

// Of texts in which each byte is written as $01, also of that which it is forced to.
TEST(VariableRecords, FitIntoASampleWithTheLongestTexts) {
  constexpr std::size_t kMostSample = std::size_t{256} * 1024;
  for (const std::uint32_t size : {20U, 96U, 255U, 1000U, kMaxVariableBytes}) {
    std::vector<VariableSymbol> symbols;
    for (int i = 0; i < 1100; ++i)
      symbols.push_back(
          text_of_bytes(fmt::format("{:04}{}", i, std::string(kMaxVariableName - 4, 'n')), size));
    const SymbolTable table = table_of(symbols);
    const auto page = select_variables(table, {});
    ASSERT_TRUE(page);
    ValueReply reply{.elements = page->elements, .forced = {}, .values = {}};
    reply.values.assign(page->elements.size() * size, std::byte{1});
    EXPECT_LT(bytes_of(records_of(table, *page, reply, reply)), kMostSample) << size;
  }
}

TEST(VariableRecords, SayWhatIsForced) {
  const SymbolTable table = plant();
  const std::vector<VariableElement> forced{{.symbol = 0, .element = 3}, {.symbol = 1, .element = 0}};
  const ValueReply forces = values_of(forced, 70);
  const auto all = select_variables(table, {});
  const auto records = records_of(table, *all, values_of(all->elements), forces);
  EXPECT_TRUE(records[0].forced);  // an element of it
  EXPECT_EQ(dds::text_of(records[0].forced_value), "");
  EXPECT_TRUE(records[1].forced);
  EXPECT_EQ(dds::text_of(records[1].forced_value), "71");
  EXPECT_FALSE(records[2].forced);

  const auto only = select_forced(table, {.patterns = {}, .forced = true}, forced);
  ASSERT_TRUE(only);
  const auto shown = records_of(table, *only, values_of(only->elements), forces);
  ASSERT_EQ(shown.size(), 2U);
  EXPECT_EQ(dds::text_of(shown[0].name), "Grid[2,0]");
  EXPECT_EQ(dds::text_of(shown[0].forced_value), "70");
  EXPECT_EQ(select_forced(table, {.patterns = {"line.*"}, .forced = true}, forced).value().rows.size(), 1U);
}

// Of another process: the reply may be of anything.
TEST(VariableRecords, TakeNothingFromAReplyThatDoesNotFit) {
  const SymbolTable table = plant();
  const auto selection = select_variables(table, {});
  ValueReply strange = values_of({{.symbol = 4000, .element = 0}});
  EXPECT_EQ(records_of(table, *selection, strange, strange).size(), 5U);
  EXPECT_EQ(records_of(table, *selection, {}, {}).size(), 5U);
  EXPECT_TRUE(select_forced(table, {}, strange.elements).value().rows.empty());
}

TEST(VariableQuery, TravelsAsItIs) {
  const VariableQuery query{.patterns = {"Line.*", "Grid[1,2]"}, .forced = true, .after = 12};
  const auto part = part_of(query);
  ASSERT_TRUE(part);
  const VariableQuery came = variable_query_of(*part);
  EXPECT_EQ(came.patterns, query.patterns);
  EXPECT_EQ(came.forced, query.forced);
  EXPECT_EQ(came.after, query.after);
  EXPECT_TRUE(variable_query_of(plc_ListPart{}).patterns.empty());
}

TEST(VariableQuery, RefusesMoreNamesThanARequestHasRoomFor) {
  const auto refused = part_of({.patterns = std::vector<std::string>(1000, "Line.speed")});
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("a request has room for 8191"));
  EXPECT_FALSE(part_of({.patterns = {""}}));
  EXPECT_FALSE(part_of({.patterns = {"a\nb"}}));
}

}  // namespace
}  // namespace plchost
