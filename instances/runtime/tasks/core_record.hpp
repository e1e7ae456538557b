#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "shm/base/flight_ring.hpp"
#include "shm/base/time.hpp"
#include "shm/pages/flight_page.hpp"

namespace plchost {

/// The holder of the core at each time, made of the entries of the flight recorder. Pure; allocates.
class CoreRecord {
 public:
  /// The IEC priorities of the tasks. `one_core`: all threads of the instance share a core, so that one task
  /// keeps others from it.
  CoreRecord(std::span<const FlightTask> tasks, bool one_core);

  /// The entries of ring `number`, of which the first one has number `first`. Once for each ring.
  void add(std::size_t number, std::span<const FlightEntry> entries, std::uint64_t first);
  /// A fault has stopped the task at that time, for good: it holds the core no longer.
  void add_fault(std::size_t task, TimePoint at) { faults_.push_back({task, at}); }
  /// No more rings come: cycles that have not ended last until `now`.
  void complete(TimePoint now);

  /// The time of a span in parts.
  struct Share {
    Duration own{};
    Duration above{};      ///< tasks with at least its priority
    std::size_t holder{};  ///< the one of them that had it longest, if above > 0
    Duration of_holder{};
    Duration none{};  ///< nothing of the instance
    Duration scheduler{};
    Duration online_change{};
    Duration halt{};
    Duration runtime{};
    Duration event_variable{};
  };
  [[nodiscard]] Share share(std::size_t task, TimePoint from, TimePoint to) const;

  /// Cycles that were lost, and the cycle before them. All times 0: that is not known, or the entries since
  /// its release of a ring that may have had the core are not here.
  struct Loss {
    std::uint64_t entry = 0;  ///< its number in the ring
    std::uint64_t lost = 0;
    TimePoint release;
    TimePoint ready;
    bool started = false;  ///< the tasks were started meanwhile
  };
  [[nodiscard]] const std::vector<Loss>& losses(std::size_t task) const { return tasks_[task].losses; }
  /// Cycles of the task that ended in that span, and the time that it spun ahead of them.
  struct Ended {
    std::uint64_t cycles = 0;
    Duration spun{};
  };
  [[nodiscard]] Ended ended(std::size_t task, TimePoint from, TimePoint to) const;

 private:
  enum class Part : std::uint8_t { cycle, halt, work, late, scheduler, online_change, variable };
  struct Piece {
    TimePoint from;
    TimePoint to;
    Part part;
  };
  struct Cycle {
    TimePoint end;
    Duration spun;
  };
  struct OfTask {
    std::int32_t priority = 0;
    std::vector<Piece> pieces;
    std::vector<Cycle> ended;
    std::vector<Loss> losses;
    bool open = false;  // the last piece has no end yet
  };

  void add_control(std::span<const FlightEntry> entries);
  void add_task(OfTask& task, std::span<const FlightEntry> entries, std::uint64_t first) const;
  [[nodiscard]] TimePoint known_since(std::size_t task) const;
  void close_faulty(std::size_t task, TimePoint at);

  bool one_core_;
  std::vector<OfTask> tasks_;
  std::vector<Piece> above_all_;  // not in the order of time
  std::vector<TimePoint> starts_;
  std::vector<TimePoint> known_since_;  // of each ring: its first entry, if there were entries before it
  struct Fault {
    std::size_t task;
    TimePoint at;
  };
  std::vector<Fault> faults_;
};

/// The cause of a loss by the parts of the time from the planned release of the cycle before to its end.
/// `own_stall`: of the own part, as long the task got no processor all the same.
[[nodiscard]] LossCause cause_of(const CoreRecord::Loss& loss, const CoreRecord::Share& share,
                                 Duration own_stall, Duration interval) noexcept;

}  // namespace plchost
