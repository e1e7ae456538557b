#include "api/recording/protobuf_message.hpp"

namespace plchost {

namespace {

// Wire types of the encoding: protobuf.dev/programming-guides/encoding.
constexpr std::uint32_t kVarint = 0;
constexpr std::uint32_t kFixed64 = 1;
constexpr std::uint32_t kLengthAndBytes = 2;

}  // namespace

void ProtobufMessage::add(std::uint32_t field, std::uint64_t value) {
  add_key(field, kVarint);
  add_varint(value);
}

void ProtobufMessage::add_fixed(std::uint32_t field, std::uint64_t value) {
  add_key(field, kFixed64);
  for (unsigned shift = 0; shift < 64; shift += 8) bytes_.push_back(static_cast<char>(value >> shift & 0xff));
}

void ProtobufMessage::add(std::uint32_t field, std::string_view text) {
  add_key(field, kLengthAndBytes);
  add_varint(text.size());
  bytes_.append(text);
}

void ProtobufMessage::add_key(std::uint32_t field, std::uint32_t wire_type) {
  add_varint(std::uint64_t{field} << 3 | wire_type);
}

void ProtobufMessage::add_varint(std::uint64_t value) {
  constexpr std::uint64_t kMore = 0x80;
  for (; value >= kMore; value >>= 7) bytes_.push_back(static_cast<char>((value & 0x7f) | kMore));
  bytes_.push_back(static_cast<char>(value));
}

}  // namespace plchost
