#pragma once

#include <array>
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "api/dds/gate/submessage.hpp"

namespace plchost::dds {

/// Puts messages of the security handshake together that come in fragments, so that Cyclone never sees a
/// fragment that nobody has signed. Cyclone 0.10.2 takes memory for the size that one fragment says, and
/// copies the bytes of another one. Holds kSamples messages that are not complete; of more, the one that has
/// waited longest goes. One thread.
class HandshakeAssembly {
 public:
  static constexpr std::size_t kSamples = 32;
  static constexpr std::size_t kMaxSample = 32U
                                            << 10U;  ///< bytes; certificates and permissions are some 5,000
  static constexpr std::size_t kMinFragment = 256;

  HandshakeAssembly();

  /// Takes the fragments out of a datagram, which admit() has passed, the first `size` bytes of
  /// `buffer`, and puts in each message that is complete with them. Returns the size that it has now; 0:
  /// nothing is left to be said.
  [[nodiscard]] std::size_t rewrite(std::span<std::byte> buffer, std::size_t size);

 private:
  static constexpr std::size_t kFragments = kMaxSample / kMinFragment;
  using Prefix = std::array<std::byte, kGuidPrefix>;

  struct Fragment {
    Prefix from{};
    EntityId reader{};
    std::uint32_t number_high = 0;
    std::uint32_t number_low = 0;
    std::uint32_t first = 0;  ///< from 0
    std::uint32_t count = 0;
    std::uint32_t size = 0;         ///< of each but the last
    std::uint32_t sample_size = 0;  ///< of all together
    std::span<const std::byte> contents{};
  };
  struct Sample {
    Prefix from{};
    EntityId reader{};
    std::uint32_t number_high = 0;
    std::uint32_t number_low = 0;
    std::uint32_t fragment_size = 0;
    std::uint32_t size = 0;  ///< 0: free
    std::uint64_t last_use = 0;
    std::bitset<kFragments> there;
    std::array<std::byte, kMaxSample> bytes{};
  };

  [[nodiscard]] static std::optional<Fragment> read(std::span<const std::byte> datagram,
                                                    const Submessage& submessage) noexcept;
  [[nodiscard]] Sample* add(const Fragment& fragment) noexcept;
  [[nodiscard]] Sample& sample_of(const Fragment& fragment) noexcept;
  void append(const Sample& sample);

  std::vector<Sample> samples_;
  std::vector<std::byte> out_;
  std::uint64_t uses_ = 0;
};

}  // namespace plchost::dds
