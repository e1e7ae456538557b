#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "shm/base/time.hpp"

namespace plchost::bench {

/// Latencies of one kind. Reserve before measuring: add() then allocates nothing.
class Samples {
 public:
  explicit Samples(std::size_t capacity) { values_.reserve(capacity); }
  /// Drops what does not fit, so that a cycle never allocates.
  void add(Duration value) noexcept {
    if (values_.size() < values_.capacity()) values_.push_back(value);
  }
  void append(const Samples& other) {
    values_.insert(values_.end(), other.values_.begin(), other.values_.end());
  }
  void clear() noexcept { values_.clear(); }
  [[nodiscard]] std::size_t size() const noexcept { return values_.size(); }
  [[nodiscard]] const std::vector<Duration>& values() const noexcept { return values_; }

 private:
  std::vector<Duration> values_;
};

/// What was measured, beside the floor that was measured in alternation with it.
struct Row {
  std::string name;
  Samples ours{0};
  Samples floor{0};
};

/// The rows as a JSON array of flat objects, times in microseconds.
[[nodiscard]] std::string to_json(const std::vector<Row>& rows);
/// The rows as a table for people.
[[nodiscard]] std::string to_table(const std::vector<Row>& rows);

}  // namespace plchost::bench
