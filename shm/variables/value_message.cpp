#include "shm/variables/value_message.hpp"

#include <algorithm>
#include <span>
#include <type_traits>
#include <utility>

#include <fmt/format.h>

namespace plchost {

namespace {

// Raise it with each change of these layouts.
constexpr std::uint32_t kVersion = 1;
constexpr std::uint32_t kRequestMagic = 0x71'72'76'70;
constexpr std::uint32_t kReplyMagic = 0x72'72'76'70;

struct RequestHead {
  std::uint32_t magic = kRequestMagic;
  std::uint32_t version = kVersion;
  std::uint64_t number = 0;
  std::uint64_t stream = 0;
  std::uint32_t kind = 0;
  std::uint32_t count = 0;  ///< of elements, which follow
};

/// In front of each packet of a reply.
struct PacketHead {
  std::uint32_t magic = kReplyMagic;
  std::uint32_t version = kVersion;
  std::uint32_t offset = 0;  ///< of the bytes of this packet within the reply
  std::uint32_t total = 0;   ///< bytes of the reply
};

/// A reply begins with it; elements, marks of forces and values follow.
struct ReplyHead {
  std::uint64_t number = 0;
  std::int64_t time_unix_ns = 0;
  std::int64_t time_monotonic_ns = 0;
  std::uint32_t count = 0;
  std::uint32_t value_bytes = 0;
  std::uint8_t code = 0;
  std::uint8_t consistent = 0;
  std::uint8_t none[6] = {};
};
static_assert(sizeof(RequestHead) == 32 && sizeof(PacketHead) == 16 && sizeof(ReplyHead) == 40);
static_assert(std::is_trivially_copyable_v<VariableElement> && sizeof(VariableElement) == 8);

constexpr std::size_t reply_size(std::size_t count, std::size_t value_bytes) noexcept {
  return sizeof(ReplyHead) + count * (sizeof(VariableElement) + 1) + value_bytes;
}
constexpr std::size_t kMaxReply = reply_size(kMaxRequestedValues, kMaxValueBytes);
constexpr std::size_t kPart = kMaxPacket - sizeof(PacketHead);
static_assert(sizeof(RequestHead) + kMaxRequestedValues * sizeof(VariableElement) <= kMaxPacket);

std::unexpected<Error> corrupt(std::string_view what) {
  return failure(ErrorCode::corrupt, fmt::format("values: {}", what));
}

template <class Item>
void append(std::string& text, std::span<const Item> items) {
  const auto bytes = std::as_bytes(items);
  text.append(reinterpret_cast<const char*>(bytes.data()), bytes.size());
}

template <class Head>
void append(std::string& text, const Head& head) {
  append(text, std::span(&head, 1));
}

/// Takes so many off the front of the bytes, which are that long.
template <class Item>
std::vector<Item> take_items(std::string_view& bytes, std::size_t count) {
  std::vector<Item> items(count);
  (void)bytes.copy(reinterpret_cast<char*>(items.data()), count * sizeof(Item));
  bytes.remove_prefix(count * sizeof(Item));
  return items;
}

template <class Head>
bool take_head(std::string_view& bytes, Head& head) {
  if (bytes.size() < sizeof head) return false;
  (void)bytes.copy(reinterpret_cast<char*>(&head), sizeof head);
  bytes.remove_prefix(sizeof head);
  return true;
}

bool is_code(std::uint8_t code) noexcept {
  return code <= std::to_underlying(ErrorCode::wrong_size);
}

Result<ValueReply> reply_of(std::string_view bytes) {
  const std::size_t size = bytes.size();
  ReplyHead head;
  if (!take_head(bytes, head) || head.count > kMaxRequestedValues || head.value_bytes > kMaxValueBytes ||
      size != reply_size(head.count, head.value_bytes) || !is_code(head.code)) {
    return corrupt("the parts of a reply do not fit together");
  }
  ValueReply reply{.number = head.number,
                   .code = static_cast<ErrorCode>(head.code),
                   .consistent = head.consistent != 0,
                   .time_unix_ns = head.time_unix_ns,
                   .time_monotonic_ns = head.time_monotonic_ns};
  reply.elements = take_items<VariableElement>(bytes, head.count);
  reply.forced = take_items<std::uint8_t>(bytes, head.count);
  reply.values = take_items<std::byte>(bytes, head.value_bytes);
  return reply;
}

}  // namespace

std::string encode(const ValueRequest& request) {
  std::string packet;
  append(packet, RequestHead{.number = request.number,
                             .stream = request.stream,
                             .kind = std::to_underlying(request.kind),
                             .count = static_cast<std::uint32_t>(request.elements.size())});
  append(packet, std::span<const VariableElement>(request.elements));
  return packet;
}

Result<ValueRequest> decode_value_request(std::string_view packet) {
  RequestHead head;
  if (!take_head(packet, head) || head.magic != kRequestMagic) return corrupt("this is no request");
  if (head.version != kVersion)
    return corrupt(fmt::format("a request of version {}; {} is needed", head.version, kVersion));
  if (head.kind > std::to_underlying(ValueKind::forced)) return corrupt("a request of an unknown kind");
  if (head.count > kMaxRequestedValues || packet.size() != head.count * sizeof(VariableElement)) {
    return corrupt(fmt::format("a request with {} elements in {} bytes; at most {} are allowed", head.count,
                               packet.size(), kMaxRequestedValues));
  }
  return ValueRequest{.number = head.number,
                      .stream = head.stream,
                      .kind = static_cast<ValueKind>(head.kind),
                      .elements = take_items<VariableElement>(packet, head.count)};
}

std::vector<std::string> encode(const ValueReply& reply) {
  std::string bytes;
  append(bytes, ReplyHead{.number = reply.number,
                          .time_unix_ns = reply.time_unix_ns,
                          .time_monotonic_ns = reply.time_monotonic_ns,
                          .count = static_cast<std::uint32_t>(reply.elements.size()),
                          .value_bytes = static_cast<std::uint32_t>(reply.values.size()),
                          .code = std::to_underlying(reply.code),
                          .consistent = reply.consistent ? std::uint8_t{1} : std::uint8_t{0}});
  append(bytes, std::span<const VariableElement>(reply.elements));
  append(bytes, std::span<const std::uint8_t>(reply.forced));
  append(bytes, std::span<const std::byte>(reply.values));
  std::vector<std::string> packets;
  for (std::size_t at = 0; at < bytes.size(); at += kPart) {
    std::string& packet = packets.emplace_back();
    append(packet, PacketHead{.offset = static_cast<std::uint32_t>(at),
                              .total = static_cast<std::uint32_t>(bytes.size())});
    packet.append(bytes, at, kPart);
  }
  return packets;
}

Result<std::optional<ValueReply>> ValueReplyReader::take(std::string_view packet) {
  PacketHead head;
  if (!take_head(packet, head) || head.magic != kReplyMagic) return corrupt("this is no reply");
  if (head.version != kVersion)
    return corrupt(fmt::format("a reply of version {}; {} is needed", head.version, kVersion));
  if (head.total > kMaxReply || head.offset != pending_.size() || head.offset > head.total ||
      packet.empty() || packet.size() > head.total - head.offset) {
    return corrupt("a packet that cannot follow");
  }
  pending_ += packet;
  if (pending_.size() < head.total) return std::nullopt;
  return reply_of(std::exchange(pending_, {}));
}

std::string values_socket_path(std::string_view run_directory, std::string_view instance) {
  return fmt::format("{}/{}.vals", run_directory, instance);
}

}  // namespace plchost
