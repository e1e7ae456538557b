#include "api/client/statistics_cache.hpp"

#include <status_fields.hpp>

#include "api/dds/host_writers.hpp"
#include "api/dds/sequence.hpp"
#include "api/dds/text.hpp"

namespace plchost {

StatisticsReport::StatisticsReport(const plc_TaskStatistics& sample) : sample_(sample) {
  sample_.ext = {};
  const auto bars = std::make_shared<std::vector<std::vector<plc_HistogramBar>>>();
  dds::visit_parts(sample_, [&](const dds::PartInfo& /*info*/, auto& part) {
    if constexpr (requires { part.bars; }) {
      const auto lent = dds::parts_of(part.bars);
      dds::lend(part.bars, bars->emplace_back(lent.begin(), lent.end()));
    }
  });
  bars_ = bars;
}

void StatisticsCache::update() {
  if (!from_) return;
  dds::take_changes<plc_TaskStatistics>(
      from_.reader.get(), writers_,
      [this](dds_instance_handle_t handle, const plc_TaskStatistics& sample) {
        reports_.insert_or_assign(handle, StatisticsReport(sample));
      },
      [this](dds_instance_handle_t handle, dds::InstanceEnd /*why*/) { reports_.erase(handle); });
}

std::optional<StatisticsReport> StatisticsCache::find(std::string_view host, std::uint64_t epoch,
                                                      std::string_view instance,
                                                      std::string_view task) const {
  for (const auto& [handle, report] : reports_) {
    const plc_TaskStatistics& sample = report.sample();
    if (sample.epoch == epoch && dds::text_of(sample.host) == host &&
        dds::text_of(sample.instance) == instance && dds::text_of(sample.task) == task) {
      return report;
    }
  }
  return std::nullopt;
}

}  // namespace plchost
