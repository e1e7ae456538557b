#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "shm/sockets/control_message.hpp"

// Any packet is either refused as corrupt, or comes back the same from a round trip.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace plchost;
  const std::string_view packet(reinterpret_cast<const char*>(data), size);
  if (const auto request = decode_request(packet)) {
    const auto again = decode_request(encode(*request));
    if (!again || again->number != request->number || again->verb != request->verb ||
        again->instance != request->instance || again->argument != request->argument ||
        again->id != request->id) {
      std::abort();
    }
  } else if (request.error().code != ErrorCode::corrupt) {
    std::abort();
  }
  if (const auto reply = decode_reply(packet)) {
    const auto again = decode_reply(encode(*reply));
    if (!again || again->number != reply->number || again->code != reply->code ||
        again->text != reply->text) {
      std::abort();
    }
  } else if (reply.error().code != ErrorCode::corrupt) {
    std::abort();
  }
  return 0;
}
