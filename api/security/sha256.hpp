#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <string_view>

namespace plchost {

/// The SHA-256 of `text` as 64 hexadecimal digits. Set-up and soft threads.
[[nodiscard]] std::string sha256(std::string_view text);

/// The same of what comes in pieces.
class Sha256 {
 public:
  Sha256();
  Sha256(const Sha256&) = delete;
  Sha256& operator=(const Sha256&) = delete;
  ~Sha256();

  void add(std::span<const std::byte> bytes);
  /// Of all that was added. Once.
  [[nodiscard]] std::string digest();

 private:
  struct Context;
  std::unique_ptr<Context> context_;
};

}  // namespace plchost
