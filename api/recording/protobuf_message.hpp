#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace plchost {

/// A message of Protocol Buffers as bytes, made field after field. Only what a trace needs.
class ProtobufMessage {
 public:
  /// An integer, enum or bool. A negative one as int64 has it.
  void add(std::uint32_t field, std::uint64_t value);
  /// A fixed64.
  void add_fixed(std::uint32_t field, std::uint64_t value);
  /// A string of UTF-8, or bytes.
  void add(std::uint32_t field, std::string_view text);
  void add(std::uint32_t field, const ProtobufMessage& message) { add(field, message.bytes()); }

  [[nodiscard]] std::string_view bytes() const noexcept { return bytes_; }
  void clear() noexcept { bytes_.clear(); }

 private:
  void add_key(std::uint32_t field, std::uint32_t wire_type);
  void add_varint(std::uint64_t value);

  std::string bytes_;
};

}  // namespace plchost
