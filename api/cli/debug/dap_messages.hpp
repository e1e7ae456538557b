#pragma once

#include <optional>
#include <string>
#include <string_view>

#include <nlohmann/json.hpp>

#include "shm/base/result.hpp"

namespace plchost {

/// The bytes of a connection of the Debug Adapter Protocol, put together to messages: a head with
/// "Content-Length: N", an empty line, N bytes of JSON.
class DapReader {
 public:
  static constexpr std::size_t kMaxHead = 1024;
  static constexpr std::size_t kMaxBody = std::size_t{1} << 20;

  void add(std::string_view bytes) { pending_ += bytes; }
  /// The next message; nothing: it is not there yet. corrupt: these bytes are no such message; the connection
  /// is of no use any more.
  [[nodiscard]] Result<std::optional<nlohmann::json>> next();

 private:
  std::string pending_;
};

/// A message as it travels.
[[nodiscard]] std::string dap_packet(const nlohmann::json& message);

}  // namespace plchost
