#pragma once

#include <utility>
#include <vector>

#include <control.h>

#include "api/dds/sequence.hpp"

namespace plchost::dds {

/// A record of a page that is kept longer than its sample. Its `ext` is a copy of its own; other sequences of
/// the record still point into the sample.
template <class Record>
class Kept : public Record {
 public:
  Kept() : Record{} {}
  Kept(const Record& record)  // not explicit: listings are filled with records
      : Record(record), entries_(parts_of(record.ext).begin(), parts_of(record.ext).end()) {
    lend(this->ext, entries_);
  }
  Kept(const Kept& other) : Kept(other.record()) {}
  Kept(Kept&& other) noexcept : Record(other.record()), entries_(std::move(other.entries_)) {
    other.ext = {};
  }
  Kept& operator=(Kept other) noexcept {
    static_cast<Record&>(*this) = other.record();
    entries_ = std::move(other.entries_);
    other.ext = {};
    return *this;
  }
  ~Kept() = default;

  /// For functions that are made for each type of a record.
  [[nodiscard]] const Record& record() const noexcept { return *this; }

 private:
  std::vector<plc_KeyValue> entries_;  // `ext` points to them
};

}  // namespace plchost::dds
