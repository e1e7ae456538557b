#pragma once

#include <span>
#include <string>
#include <vector>

#include "instances/adapters/iec/project.hpp"
#include "instances/adapters/iec/source_place.hpp"

namespace plchost::matiec {

/// All sources one behind the other, as iec2c takes one file, and where each began. Some things are replaced,
/// and no other word moves: comments of the third edition, pragmas of other tools, the mark of UTF-8. So are
/// locations in lower case, and intervals in units that iec2c does not know: it needs only that there is one.
/// In texts, "(*" and $L are written by codes.
class JoinedSource {
 public:
  explicit JoinedSource(std::span<const iec::Source> sources);
  [[nodiscard]] const std::string& text() const noexcept { return text_; }
  /// Of a place in the joined file.
  [[nodiscard]] iec::SourcePlace place(unsigned line, unsigned column) const;

 private:
  struct Part {
    std::string file;
    unsigned first_line;
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
