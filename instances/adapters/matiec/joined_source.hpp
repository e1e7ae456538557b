#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "instances/adapters/iec/project.hpp"
#include "instances/adapters/iec/source_place.hpp"

namespace plchost::matiec {

/// All sources one behind the other, as iec2c takes one file, and where each began. Some things are replaced,
/// and no other word moves: comments of the third edition, pragmas of other tools, the mark of UTF-8,
/// VAR_TEMP. So are locations in lower case, and intervals in units that iec2c does not know: it needs only
/// that there is one. Actions of charts get a comment. In texts, "(*" and $L are written by codes.
class JoinedSource {
 public:
  explicit JoinedSource(std::span<const iec::Source> sources);
  [[nodiscard]] const std::string& text() const noexcept { return text_; }
  /// Of a place in the joined file, as iec2c counts columns: in bytes, and one too many where a body begins.
  /// The result counts characters, as editors do.
  [[nodiscard]] iec::SourcePlace place(unsigned line, unsigned column) const;

 private:
  struct Part {
    [[nodiscard]] unsigned column(unsigned of_line, unsigned bytes) const;

    std::string file;
    unsigned first_line;
    std::string source;               ///< without the mark of UTF-8
    std::vector<std::size_t> bodies;  ///< where they begin in it. In order
  };
  /// Words that are inserted, by where they stand in the joined file. In order.
  struct Insertion {
    unsigned line;
    unsigned column;
    unsigned bytes;
  };
  std::vector<Part> parts_;
  std::vector<Insertion> insertions_;
  std::string text_;
};

}  // namespace plchost::matiec
