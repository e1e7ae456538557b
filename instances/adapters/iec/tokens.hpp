#pragma once

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
    pragma,   ///< {...}, with its braces
    symbol,   ///< := ( ) ; : , .. and all other characters
    end,      ///< of the file
  };
  Kind kind = Kind::end;
  std::string text;  ///< as it stands in the source
  SourcePlace place;

  /// Case does not count in names.
  [[nodiscard]] bool is(std::string_view word) const noexcept;
};

/// Upper case, as IEC compares names.
[[nodiscard]] std::string folded(std::string_view name);

struct Tokens {
  std::vector<Token> all;  ///< the last one is an `end`
  SourceProblems problems;
};

/// Any text, hostile ones included. Comments are left out: (* *), // and /* */.
[[nodiscard]] Tokens tokens_of(std::string_view text, const std::string& file);

}  // namespace plchost::iec
