#include "schedulers/tasks/priorities.hpp"

#include "schedulers/settings/task_options.hpp"

namespace plchost {

namespace {

// The highest SCHED_FIFO priority of a band; its supervision has it.
int top_of(PriorityBand band) noexcept {
  switch (band) {
    case PriorityBand::high:
      return 89;
    case PriorityBand::normal:
      return 69;
    case PriorityBand::low:
      break;
  }
  return 49;
}

}  // namespace

ThreadPriority supervision_priority(PriorityBand band) noexcept {
  return {.fifo = top_of(band), .nice = 0};
}

ThreadPriority tick_priority(PriorityBand band) noexcept {
  return {.fifo = top_of(band) - 1, .nice = 0};
}

ThreadPriority task_priority(PriorityBand band, int iec_priority) noexcept {
  if (iec_priority <= kLowestRealTimeIecPriority) return {.fifo = top_of(band) - 2 - iec_priority, .nice = 0};
  return {.fifo = 0, .nice = iec_priority - kLowestRealTimeIecPriority - 1};
}

ThreadPriority switch_priority(PriorityBand band) noexcept {
  return {.fifo = task_priority(band, kLowestRealTimeIecPriority).fifo - 1, .nice = 0};
}

}  // namespace plchost
