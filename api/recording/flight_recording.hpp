#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "api/dds/trace_page.hpp"

namespace plchost {

/// The recorded entries of one thread of an instance: of a task also over several processes.
struct RecordedRing {
  /// Something is missing before an entry, or another process has written it.
  struct Gap {
    std::size_t before = 0;     ///< index of the entry, which may be none yet
    std::uint64_t missing = 0;  ///< entries that were written over
    std::int32_t process = 0;   ///< of the new process; 0: it is the same
  };

  std::uint32_t ring = 0;  ///< as FlightPage numbers them, in the newest process
  std::string task;        ///< printable; empty: it is none
  std::int32_t iec_priority = 0;
  std::uint32_t event_mark = 0;
  std::vector<FlightEntry> entries;
  std::vector<Gap> gaps;

 private:
  friend class FlightRecording;
  std::uint64_t next_ = 0;  // number of the entry that comes next
  std::uint64_t page_ = 0;  // the last one that had the ring
};

/// The entries of the flight recorder of an instance, put together of pages that overlap. A host may be any
/// program: entries that cannot be of that time are left out and counted.
class FlightRecording {
 public:
  /// @param core of the instance; -1: none, or several
  FlightRecording(std::string instance, std::int32_t core) : instance_(std::move(instance)), core_(core) {}

  /// The first listing is where the recording begins: of it only the time and the numbers count.
  void add(const TraceListing& listing);

  [[nodiscard]] const std::string& instance() const noexcept { return instance_; }
  [[nodiscard]] std::int32_t core() const noexcept { return core_; }
  [[nodiscard]] const std::vector<RecordedRing>& rings() const noexcept { return rings_; }
  /// By CLOCK_MONOTONIC of the host.
  [[nodiscard]] std::int64_t begin_ns() const noexcept { return begin_ns_; }
  [[nodiscard]] std::int64_t end_ns() const noexcept { return end_ns_; }
  [[nodiscard]] std::size_t entries() const noexcept { return entries_; }
  [[nodiscard]] std::uint64_t missing() const noexcept { return missing_; }
  [[nodiscard]] std::uint64_t damaged() const noexcept { return damaged_; }

 private:
  void begin_process(std::int32_t pid);
  RecordedRing* ring_of(const TraceRing& told);
  void add(RecordedRing& ring, const TraceRing& told, std::int64_t until_ns);

  std::string instance_;
  std::int32_t core_;
  std::vector<RecordedRing> rings_;
  std::int32_t pid_ = 0;
  std::uint64_t pages_ = 0;
  std::int64_t begin_ns_ = 0;
  std::int64_t end_ns_ = 0;
  std::size_t entries_ = 0;
  std::uint64_t missing_ = 0;
  std::uint64_t damaged_ = 0;
};

}  // namespace plchost
