#pragma once

#include <string>
#include <string_view>

namespace plchost {

/// The SHA-256 of `text` as 64 hexadecimal digits. Set-up and soft threads.
[[nodiscard]] std::string sha256(std::string_view text);

}  // namespace plchost
