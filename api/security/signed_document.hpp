#pragma once

#include <string>
#include <string_view>

#include "api/security/certificates.hpp"

namespace plchost::security {

/// The text signed as DDS Security wants governance and permissions: S/MIME, as `openssl smime -sign -text`.
[[nodiscard]] Result<std::string> sign_document(std::string_view text, const Authority& authority);

/// The text inside. refused: not signed by that authority, or altered; `what` is how the error calls it.
[[nodiscard]] Result<std::string> open_document(std::string_view what, std::string_view document,
                                                const Certificate& authority);

}  // namespace plchost::security
