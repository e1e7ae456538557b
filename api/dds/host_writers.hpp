#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include <dds/dds.h>

#include "api/dds/instances.hpp"
#include "api/dds/samples.hpp"
#include "api/dds/text.hpp"

namespace plchost::dds {

/// Which host is behind a writer: the one that the writer's partition names. A writer only gets into a
/// partition that the permission of its identity allows, which each receiver checks, and the permission of a
/// host names that host. A sample of one host in the name of another is therefore found by its partition. One
/// thread.
class HostWriters {
 public:
  /// Whether the writer of that sample may speak for `host`. False, too, if that writer is gone and was not
  /// seen before.
  [[nodiscard]] bool speaks_for(std::string_view host, dds_entity_t reader, const dds_sample_info_t& info);
  /// The host behind a writer that the reader has met. Empty: none, or that writer is gone and was not seen
  /// before.
  [[nodiscard]] std::string host_behind(dds_entity_t reader, dds_instance_handle_t writer);

 private:
  static constexpr std::size_t kMost = 16384;

  /// nullptr: that writer is gone and was not seen before.
  [[nodiscard]] const std::string* find(dds_entity_t reader, dds_instance_handle_t writer);

  std::unordered_map<dds_instance_handle_t, std::string> hosts_;
};

/// The host that a writer's partition names; empty: it names none. See topics.hpp.
[[nodiscard]] std::string_view host_in_partition(std::string_view partition) noexcept;

/// The hosts whose presence has a writer that discovery knows, by name: also those of which no reader takes
/// anything. Any thread.
[[nodiscard]] std::vector<std::string> discovered_hosts(dds_entity_t participant);

/// As take_all(), of the samples that the host has written that they speak of.
template <class Sample, std::size_t Max = 64, class Function>
void take_told(dds_entity_t reader, HostWriters& writers, Function use) {
  take_all<Sample, Max>(reader, [&](const Sample& sample, const dds_sample_info_t& info) {
    // Nobody has written that an instance has no writer any more.
    const bool untold = info.instance_state == DDS_IST_NOT_ALIVE_NO_WRITERS && !info.valid_data;
    if (untold || writers.speaks_for(text_of(sample.host), reader, info)) use(sample, info);
  });
}

/// The same, of the valid ones only.
template <class Sample, std::size_t Max = 64, class Function>
void take_valid_told(dds_entity_t reader, HostWriters& writers, Function use) {
  take_told<Sample, Max>(reader, writers, [&use](const Sample& sample, const dds_sample_info_t& info) {
    if (info.valid_data) use(sample, info);
  });
}

/// The epoch in the last sample of a row that has gone. DDS lets anyone dispose a row, and does not tell who
/// it was as long as a sample of the row has not been taken.
inline constexpr std::uint64_t kEndOfRow = 0;

/// Ends the row of `row`, as its host. `writer` must have written it. Changes `row`.
template <class Sample>
void end_row(dds_entity_t writer, Sample& row) {
  row.epoch = kEndOfRow;
  (void)dds_writedispose(writer, &row);
  unregister_instance(writer, &row);
}

/// Why an instance has no sample any more.
enum class InstanceEnd : std::uint8_t {
  disposed,      ///< its host says that there is no such thing
  without_host,  ///< none of its writers is seen any more
};

/// The same, for what is kept of each instance: `update(handle, sample)`, then `end(handle, why)` if it has
/// ended. After that the handle means nothing. If the same writer is seen again, as after a pause of its
/// process or of the network, it tells all that there is then. The same key has another handle then.
template <class Sample, class Update, class End>
void take_changes(dds_entity_t reader, HostWriters& writers, Update update, End end) {
  take_told<Sample>(reader, writers, [&](const Sample& sample, const dds_sample_info_t& info) {
    const bool ended =
        info.valid_data ? sample.epoch == kEndOfRow : info.instance_state == DDS_IST_NOT_ALIVE_DISPOSED;
    if (info.valid_data && !ended) update(info.instance_handle, sample);
    if (ended) end(info.instance_handle, InstanceEnd::disposed);
    if (info.instance_state == DDS_IST_NOT_ALIVE_NO_WRITERS) {
      end(info.instance_handle, InstanceEnd::without_host);
    }
  });
}

}  // namespace plchost::dds
