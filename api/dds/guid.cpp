#include "api/dds/guid.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace plchost::dds {

Guid Guid::participant() const noexcept {
  constexpr std::array<std::uint8_t, 4> kParticipantEntity{0x00, 0x00, 0x01, 0xc1};
  Guid result = *this;
  std::ranges::copy(kParticipantEntity, result.bytes.begin() + 12);
  return result;
}

std::string Guid::hex() const {
  return fmt::format("{:02x}", fmt::join(bytes, ""));
}

Guid guid_of(dds_entity_t entity) noexcept {
  dds_guid_t raw{};
  if (dds_get_guid(entity, &raw) != DDS_RETCODE_OK) return {};
  return Guid::from(raw.v);
}

Guid writer_of(dds_entity_t reader, const dds_sample_info_t& info) noexcept {
  dds_builtintopic_endpoint_t* const endpoint =
      dds_get_matched_publication_data(reader, info.publication_handle);
  if (endpoint == nullptr) return {};
  const Guid guid = Guid::from(endpoint->key.v);
  dds_builtintopic_free_endpoint(endpoint);
  return guid;
}

namespace {

template <class Get>
std::vector<dds_instance_handle_t> all_met(Get get, dds_entity_t entity) {
  std::vector<dds_instance_handle_t> met(16);
  for (;;) {
    const dds_return_t count = get(entity, met.data(), met.size());
    const std::size_t found = count < 0 ? 0 : static_cast<std::size_t>(count);
    const bool all = found <= met.size();
    met.resize(found);
    if (all) return met;
  }
}

}  // namespace

std::vector<dds_instance_handle_t> writers_of(dds_entity_t reader) {
  return all_met(&dds_get_matched_publications, reader);
}

std::vector<dds_instance_handle_t> readers_of(dds_entity_t writer) {
  return all_met(&dds_get_matched_subscriptions, writer);
}

}  // namespace plchost::dds
