#pragma once

#include <cstdint>

#include <dds/dds.h>

namespace plchost {

/// Whether a writer has met a reader.
[[nodiscard]] inline bool has_reader(dds_entity_t writer) noexcept {
  dds_publication_matched_status_t status{};
  return dds_get_publication_matched_status(writer, &status) == DDS_RETCODE_OK && status.current_count > 0;
}

/// The readers that a writer has met so far.
class MetReaders {
 public:
  /// Whether the writer has met a reader since the last call.
  [[nodiscard]] bool look(dds_entity_t writer) noexcept {
    dds_publication_matched_status_t status{};
    const bool known = dds_get_publication_matched_status(writer, &status) == DDS_RETCODE_OK;
    const std::uint32_t met = known ? status.total_count : 0;
    if (met == met_) return false;
    met_ = met;
    return true;
  }

 private:
  std::uint32_t met_ = 0;  // also those that are gone
};

}  // namespace plchost
