#include "api/gateway/block_sample.hpp"

#include "api/dds/sequence.hpp"

namespace plchost {

plc_Block block_sample(const BlockHeader& header, std::span<const std::byte> contents,
                       std::uint64_t sequence_number) noexcept {
  const NodeAddress source = NodeAddress::from_number(header.source);
  const NodeAddress destination = NodeAddress::from_number(header.destination);
  plc_Block sample{};
  sample.sequence_number = sequence_number;
  sample.source_host = source.host;
  sample.source_node = source.node;
  sample.destination_host = destination.host;
  sample.destination_node = destination.node;
  sample.channel = header.channel;
  sample.correlation = header.correlation;
  sample.source_sequence = header.sequence;
  sample.source_generation = header.epoch;
  sample.kind = header.kind;
  sample.priority = header.priority;
  sample.hosts = header.hosts;
  dds::lend_bytes(sample.contents, contents);
  return sample;
}

std::optional<BlockHeader> block_header(const plc_Block& sample, std::uint16_t from,
                                        std::uint16_t own) noexcept {
  const NodeAddress source{.host = sample.source_host, .node = sample.source_node};
  const NodeAddress destination{.host = sample.destination_host, .node = sample.destination_node};
  const bool for_us = destination.host == own || destination.host == NodeAddress::kAllHosts;
  if (source.host != from || from == own || from == 0 || !for_us) return std::nullopt;
  BlockHeader header;
  header.size = sample.contents._length;
  header.destination = destination.number();
  header.source = source.number();
  header.channel = sample.channel;
  header.correlation = sample.correlation;
  header.sequence = sample.source_sequence;
  header.epoch = sample.source_generation;
  header.kind = sample.kind;
  header.priority = sample.priority;
  header.hosts = sample.hosts;
  if (!is_sane(header) || header.hosts >= kMaxHops) return std::nullopt;
  return header;
}

std::span<const std::byte> block_contents(const plc_Block& sample) noexcept {
  return std::as_bytes(dds::parts_of(sample.contents));
}

}  // namespace plchost
