#pragma once

#include <algorithm>
#include <memory>
#include <tuple>
#include <utility>

#include <control.h>
#include <status_topics.hpp>

#include "api/dds/text.hpp"
#include "api/dds/topics.hpp"
#include "api/server/status/status_table.hpp"

namespace plchost {

/// A table with the topic of its type, written into the partition of `publisher`.
template <class Sample>
[[nodiscard]] Result<StatusTable<Sample>> open_table(dds_entity_t participant, dds_entity_t publisher,
                                                     const StatusSource& source) {
  constexpr const dds::TopicInfo& kTopic = dds::kTopicOf<Sample>;
  PLCHOST_TRY_ASSIGN(auto way, dds::open_writer(participant, publisher, kTopic));
  return StatusTable<Sample>(source, std::move(way));
}

/// The tables of all status topics that HostStatus counts: those of control.idl. Stays where it is made.
class StatusTables {
 public:
  [[nodiscard]] static Result<std::unique_ptr<StatusTables>> create(dds_entity_t participant,
                                                                    dds_entity_t publisher,
                                                                    const StatusSource& source) {
    auto made = std::make_unique<StatusTables>();
    Result<void> result;
    std::apply([&](auto&... table) { (void)(open(participant, publisher, source, table, result) && ...); },
               made->tables_);
    PLCHOST_TRY(std::move(result));
    return made;
  }

  template <class Sample>
  [[nodiscard]] StatusTable<Sample>& of() noexcept {
    return std::get<StatusTable<Sample>>(tables_);
  }

  /// Tells how many samples each has.
  void count(plc_HostStatus& status) const noexcept {
    static_assert(std::tuple_size_v<Tables> <= std::extent_v<decltype(plc_HostStatus::counts)>);
    std::size_t next = 0;
    const auto add = [&]<class Sample>(const StatusTable<Sample>& table) {
      plc_TopicCount& count = status.counts[next++];
      dds::copy_text(count.topic, dds::kCountedAs<Sample>);
      count.samples = table.size();
    };
    std::apply([&](const auto&... table) { (add(table), ...); }, tables_);
  }

 private:
  template <class... Samples>
  using TablesOf = std::tuple<StatusTable<Samples>...>;
  using Tables = dds::OfCountedStatus<TablesOf>;

  template <class Sample>
  static bool open(dds_entity_t participant, dds_entity_t publisher, const StatusSource& source,
                   StatusTable<Sample>& table, Result<void>& result) {
    const auto make = [&]() -> Result<void> {
      PLCHOST_TRY_ASSIGN(table, open_table<Sample>(participant, publisher, source));
      return {};
    };
    result = make();
    return result.has_value();
  }

  Tables tables_;
};

}  // namespace plchost
