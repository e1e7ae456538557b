#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "instances/adapters/iec/source_place.hpp"

namespace plchost::iec {

/// A word of Structured Text.
struct Token {
  enum class Kind : unsigned char {
    name,     ///< also the key words
    number,   ///< 10, 1.5, 16#FF
    literal,  ///< with a type: T#20ms, INT#5
    text,     ///< 'abc', with its quotes
    place,    ///< of a located variable: %IX0.1
    pragma,   ///< {...} or {{...}}, with its braces
    symbol,   ///< := ( ) ; : , .. and all other characters
    end,      ///< of the file
  };
  Kind kind = Kind::end;
  std::string text;  ///< as it stands in the source
  SourcePlace place;
  std::size_t offset = 0;  ///< of its first byte in the file

  /// Case does not count in names.
  [[nodiscard]] bool is(std::string_view word) const noexcept;
};

/// Upper case, as IEC compares names.
[[nodiscard]] std::string folded(std::string_view name);

/// Bytes of a file.
struct Stretch {
  std::size_t offset = 0;
  std::size_t bytes = 0;
};

struct Tokens {
  std::vector<Token> all;             ///< the last one is an `end`
  std::vector<Stretch> new_comments;  ///< those of the third edition: //, /* */, and (* (* *) *)
  SourceProblems problems;
};

/// The bytes of the mark of UTF-8 that some editors write at the begin of a file; else 0.
[[nodiscard]] std::size_t byte_order_mark(std::string_view text) noexcept;

/// As editors count columns: by characters of UTF-8.
[[nodiscard]] unsigned characters_in(std::string_view text) noexcept;

/// Any text, hostile ones included. Comments are left out: (* *), // and /* */. So is the mark of UTF-8.
[[nodiscard]] Tokens tokens_of(std::string_view text, const std::string& file);

}  // namespace plchost::iec
