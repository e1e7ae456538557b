#pragma once

#include <cstddef>
#include <optional>
#include <string_view>

namespace plchost {

struct Utf8Character {
  char32_t code = 0;
  std::size_t bytes = 0;  ///< that it has in the text: 1 to 4
};

/// The character that a text begins with, which is not empty. Nothing: it is not well-formed there. Shorter
/// forms must be used, and halves of a pair of UTF-16 are no characters.
[[nodiscard]] std::optional<Utf8Character> first_utf8(std::string_view text) noexcept;

/// Whether it is one of the bytes behind the first one of a character.
[[nodiscard]] constexpr bool continues_utf8(char byte) noexcept {
  return (static_cast<unsigned char>(byte) & 0xC0U) == 0x80U;
}

}  // namespace plchost
