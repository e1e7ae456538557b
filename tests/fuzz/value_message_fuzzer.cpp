#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include "shm/variables/value_message.hpp"

// Any packet is refused as corrupt, or comes back the same from a round trip.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace plchost;
  const std::string_view packet(reinterpret_cast<const char*>(data), size);
  if (const auto request = decode_value_request(packet)) {
    if (encode(*request) != packet) std::abort();
  } else if (request.error().code != ErrorCode::corrupt) {
    std::abort();
  }
  // As packets of one connection, the first byte of each its length.
  ValueReplyReader reader;
  for (std::string_view rest = packet; !rest.empty();) {
    const std::size_t length =
        std::min<std::size_t>(1 + static_cast<unsigned char>(rest.front()), rest.size());
    const auto reply = reader.take(rest.substr(1, length - 1));
    rest.remove_prefix(length);
    if (!reply && reply.error().code != ErrorCode::corrupt) std::abort();
    if (!reply) break;
    if (!*reply) continue;
    ValueReplyReader again;
    std::optional<ValueReply> same;
    for (const std::string& part : encode(**reply)) same = again.take(part).value();
    if (!same || same->elements != (*reply)->elements || same->values != (*reply)->values) std::abort();
  }
  return 0;
}
