#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string_view>

#include "instances/runtime/application/elf_bytes.hpp"

namespace plchost {

/// Reads numbers and texts from bytes that nobody vouches for, in this processor's order. Beyond the end all
/// are 0 or empty, and good() is false from then on.
class ByteReader {
 public:
  ByteReader() noexcept = default;
  explicit ByteReader(std::span<const std::byte> bytes) noexcept : left_(bytes) {}

  [[nodiscard]] bool good() const noexcept { return good_; }
  [[nodiscard]] bool empty() const noexcept { return left_.empty(); }
  [[nodiscard]] std::size_t size() const noexcept { return left_.size(); }

  template <class T>
  T number() noexcept {
    T value{};
    const auto bytes = take(sizeof value);
    if (bytes.size() == sizeof value) std::memcpy(&value, bytes.data(), sizeof value);
    return value;
  }
  /// LEB128. Bits above the 64th are dropped.
  std::uint64_t unsigned_leb() noexcept {
    unsigned bits = 0;
    return leb(bits);
  }
  std::int64_t signed_leb() noexcept {
    unsigned bits = 0;
    const std::uint64_t value = leb(bits);
    const bool negative = bits > 0 && bits < kBits && ((value >> (bits - 1)) & 1U) != 0;
    return static_cast<std::int64_t>(negative ? value | (~std::uint64_t{0} << bits) : value);
  }
  /// As far as a zero, which is skipped.
  std::string_view text() noexcept {
    const std::string_view text = text_in(left_);
    if (text.size() == left_.size()) {
      fail();
      return {};
    }
    left_ = left_.subspan(text.size() + 1);
    return text;
  }
  void skip(std::uint64_t count) noexcept { (void)take(count); }
  [[nodiscard]] ByteReader part(std::uint64_t count) noexcept { return ByteReader(take(count)); }

 private:
  static constexpr unsigned kBits = 64;

  void fail() noexcept {
    good_ = false;
    left_ = {};
  }
  std::span<const std::byte> take(std::uint64_t count) noexcept {
    if (count > left_.size()) {
      fail();
      return {};
    }
    const auto taken = left_.first(count);
    left_ = left_.subspan(count);
    return taken;
  }
  std::uint64_t leb(unsigned& bits) noexcept {
    constexpr unsigned kPerByte = 7;
    constexpr unsigned kGoesOn = 0x80;
    std::uint64_t value = 0;
    for (;;) {
      const auto byte = number<std::uint8_t>();
      if (bits < kBits) value |= std::uint64_t{byte & (kGoesOn - 1U)} << bits;
      bits = std::min(bits + kPerByte, kBits);
      if ((byte & kGoesOn) == 0) return value;  // also at the end
    }
  }

  std::span<const std::byte> left_;
  bool good_ = true;
};

}  // namespace plchost
