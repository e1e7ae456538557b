#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>

namespace plchost::dds {

/// The type of the parts of a sequence of control.idl.
template <class Sequence>
using PartOf = std::remove_pointer_t<decltype(Sequence::_buffer)>;

/// The parts of a sequence. Valid as long as its sample.
template <class Sequence>
[[nodiscard]] std::span<const PartOf<Sequence>> parts_of(const Sequence& sequence) noexcept {
  return {sequence._buffer, sequence._length};
}

/// Points a sequence to `parts`, which outlive the use of its sample.
template <class Sequence>
void lend(Sequence& sequence, std::span<const PartOf<Sequence>> parts) noexcept {
  // DDS only reads them; its generated types know no const.
  sequence._buffer = const_cast<PartOf<Sequence>*>(parts.data());
  sequence._length = sequence._maximum = static_cast<std::uint32_t>(parts.size());
  sequence._release = false;
}

/// The same, of a sequence of octets.
template <class Sequence>
void lend_bytes(Sequence& sequence, std::span<const std::byte> bytes) noexcept {
  lend(sequence, std::span(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()));
}

}  // namespace plchost::dds
