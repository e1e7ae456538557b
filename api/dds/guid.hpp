#pragma once

#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <string>
#include <vector>

#include <dds/dds.h>

namespace plchost::dds {

/// The identity of a DDS entity. The first 12 bytes are the same for all entities of one participant.
struct Guid {
  std::array<std::uint8_t, 16> bytes{};

  auto operator<=>(const Guid&) const = default;

  [[nodiscard]] static Guid from(const std::uint8_t (&raw)[16]) noexcept {
    Guid guid;
    std::memcpy(guid.bytes.data(), raw, sizeof raw);
    return guid;
  }
  void copy_to(std::uint8_t (&raw)[16]) const noexcept { std::memcpy(raw, bytes.data(), sizeof raw); }
  /// The participant that this entity belongs to.
  [[nodiscard]] Guid participant() const noexcept;
  /// 32 hexadecimal digits.
  [[nodiscard]] std::string hex() const;
};

struct GuidHash {
  [[nodiscard]] std::size_t operator()(const Guid& guid) const noexcept {
    std::uint64_t halves[2];
    std::memcpy(halves, guid.bytes.data(), sizeof halves);
    return std::hash<std::uint64_t>{}(halves[0] * 0x9e3779b97f4a7c15U ^ halves[1]);
  }
};

/// The GUID of an entity of this process; all zero if it has none.
[[nodiscard]] Guid guid_of(dds_entity_t entity) noexcept;

/// The GUID of the remote writer that wrote a sample: the claim of the header must equal it. All zero if the
/// writer is gone already.
[[nodiscard]] Guid writer_of(dds_entity_t reader, const dds_sample_info_t& info) noexcept;

/// The writers that a reader is matched with, also those that have sent nothing yet. As publication_handle.
[[nodiscard]] std::vector<dds_instance_handle_t> writers_of(dds_entity_t reader);
/// The readers that a writer has met.
[[nodiscard]] std::vector<dds_instance_handle_t> readers_of(dds_entity_t writer);

}  // namespace plchost::dds
