// The records of pages that a newer host has written: a field more is an entry of their `ext`.
#include "api/dds/kept_record.hpp"

#include <array>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "api/cli/rows/log_rows.hpp"
#include "api/cli/rows/node_rows.hpp"
#include "api/cli/rows/object_rows.hpp"
#include "api/cli/rows/variable_rows.hpp"
#include "api/dds/text.hpp"

namespace plchost {
namespace {

/// A page as it lies on loan: with its end nothing of it can be read any more.
template <class Page, class Record>
class LoanedPage {
 public:
  LoanedPage(Page page, dds::PartOf<decltype(Record::ext)> entry) : page_(page), ext_{entry} {
    dds::lend(records_.front().ext, ext_);
  }
  LoanedPage(const LoanedPage&) = delete;
  LoanedPage& operator=(const LoanedPage&) = delete;
  ~LoanedPage() { ext_.front() = {}; }

  template <class Sequence>
  auto listing(Sequence Page::* records) {
    dds::lend(page_.*records, records_);
    return listing_of(page_);
  }

 private:
  Page page_;
  std::vector<plc_KeyValue> ext_;
  std::vector<Record> records_ = std::vector<Record>(1);
};

plc_KeyValue colour() {
  plc_KeyValue entry{};
  dds::copy_text(entry.name, "colour");
  dds::copy_text(entry.value, "red");
  return entry;
}

template <class Record, class Page, class Sequence>
auto told(Sequence Page::* records) {
  LoanedPage<Page, Record> page({}, colour());
  return page.listing(records);
}

TEST(RecordsOfANewerHost, ShowTheFieldsThatTheyHaveMore) {
  const auto objects = told<plc_ObjectRecord>(&plc_ObjectPage::objects);
  EXPECT_EQ(to_row("north", objects.objects.at(0)).at("colour"), "red");
  const auto nodes = told<plc_NodeRecord>(&plc_NodePage::nodes);
  EXPECT_EQ(to_row(nodes.nodes.at(0).record(), std::string_view("north"), nodes).at("colour"), "red");
  const auto routes = told<plc_RouteRecord>(&plc_NodePage::routes);
  EXPECT_EQ(route_row(routes.routes.at(0), "north", routes, routes).at("colour"), "red");
  const auto variables = told<plc_VariableRecord>(&plc_VariablePage::variables);
  EXPECT_EQ(to_row(variables.variables.at(0).record(), VariableOwner{"north", "line1"}).at("colour"), "red");
  auto log = told<plc_LogRecord>(&plc_LogPage::records);
  log.records[0].sequence_number = 1;
  EXPECT_EQ(to_row("north", "line1", LogLines().add(log.records).at(0)).at("colour"), "red");
}

std::string colour_of(const dds::Kept<plc_LogRecord>& record) {
  const auto entries = dds::parts_of(record.ext);
  return entries.size() == 1 ? std::string(dds::text_of(entries[0].value)) : std::string();
}

TEST(KeptRecord, HasItsEntriesAlsoWhenItIsCopiedAndMoved) {
  std::array<plc_KeyValue, 1> entries{colour()};
  plc_LogRecord record{};
  dds::lend(record.ext, entries);
  dds::Kept<plc_LogRecord> first(record);
  entries[0] = {};
  EXPECT_EQ(colour_of(first), "red");
  dds::Kept<plc_LogRecord> second;
  EXPECT_EQ(colour_of(second), "");
  second = first;
  EXPECT_NE(second.ext._buffer, first.ext._buffer);
  const dds::Kept<plc_LogRecord> third(std::move(first));
  EXPECT_EQ(colour_of(second), "red");
  EXPECT_EQ(colour_of(third), "red");
}

}  // namespace
}  // namespace plchost
