#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace plchost::dds {

enum class ParameterList : std::uint8_t {
  discovery,          ///< a participant's data about itself and about its readers and writers
  secured_discovery,  ///< the same with its tokens, of a secured host
  inline_qos,         ///< the parameters in front of the contents of a sample
};

/// Keeps of a list of parameters what this host needs, and only in the exact form that it has: sizes, and
/// texts and sequences that fit. Every other parameter that a reader may skip becomes padding of the same
/// size, so that Cyclone 0.10.2 does not parse it. These are type information (it aborts on some),
/// properties, tokens, and numbers of Cyclone's own that another vendor uses for something else. Topics match
/// by the names of their types then, as they do with the clients of other vendors.
///
/// `list` begins with the first parameter; `guid_prefix` is the one of the message's header: a participant
/// speaks for itself only. Returns the size of the list with its end; 0: the list is malformed.
[[nodiscard]] std::size_t filter_parameters(std::span<std::byte> list, bool little, ParameterList kind,
                                            std::span<const std::byte> guid_prefix) noexcept;

}  // namespace plchost::dds
