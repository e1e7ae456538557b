#include "tests/bench/parts.hpp"

#include <array>

namespace plchost::bench {

namespace {

constexpr std::string_view kStart = "latency from the planned release to the first instruction (logarithmic)";
constexpr std::string_view kCyclesLater = "share of cycles that start later";
constexpr std::string_view kPost = "time from the post to the first instruction of the task (logarithmic)";
constexpr std::string_view kPostsLonger = "share of posts that take longer";

}  // namespace

std::span<const Part> all_parts() noexcept {
  static constexpr std::array kParts = {
      Part{.name = "cyclic",
           .about = "1 ms tasks under each scheduler, beside clock_nanosleep in alternation",
           .picture =
               {.title = "Start latency of a 1 ms task",
                .x = kStart,
                .y = kCyclesLater,
                .floor = "F, a bare thread in clock_nanosleep",
                .notes =
                    {"Ours and the floor run in turns, so each has stalls of the host of its own: the parts "
                     "of the curves",
                     "below 0.5 %. In corun, a stall hits ours and the floor at the same time."}},
           .turns = 6.3,
           .under_stress = true,
           .measure = &measure_cyclic},
      Part{.name = "corun",
           .about = "1 ms tasks beside clock_nanosleep at the same time on the same core",
           .picture = {.title = "Start latency of a 1 ms task and of its floor at the same time",
                       .x = kStart,
                       .y = kCyclesLater,
                       .floor = "F on the same core",
                       .notes = {"A stall of the host hits ours and the floor, so the tails lie beside each "
                                 "other."}},
           .turns = 3.2,
           .under_stress = true,
           .measure = &measure_corun},
      Part{.name = "cyclictest",
           .about = "cyclictest beside clock_nanosleep",
           .picture = {},
           .turns = 2.1,
           .under_stress = true,
           .measure = &measure_cyclictest},
      Part{.name = "fast",
           .about = "CmpScheduleOneShot at 250 us and 100 us beside a spinning loop",
           .picture =
               {.title = "Start latency at 250 µs and 100 µs",
                .x = kStart,
                .y = kCyclesLater,
                .floor = "a thread that only spins",
                .notes =
                    {"The floor never sleeps, so its median is lower. The kernel takes up to 5 % of the core "
                     "from a thread",
                     "that only spins: the step of the floor at 50 ms. Ours sleeps, and has none."}},
           .turns = 8.4,
           .under_stress = true,
           .measure = &measure_fast},
      Part{.name = "burst",
           .about = "100 tasks due at one tick",
           .picture = {},
           .turns = 3.3,
           .under_stress = true,
           .measure = &measure_burst},
      Part{.name = "post_process",
           .about = "posts from another process beside a raw futex",
           .picture = {.title = "Post of an external event by another process",
                       .x = kPost,
                       .y = kPostsLonger,
                       .floor = "a raw futex wake",
                       .notes = {"Ours and the floor run in turns, so each has stalls of the host of its "
                                 "own: below 0.3 %."}},
           .turns = 4.4,
           .under_stress = true,
           .measure = &measure_post_process},
      Part{.name = "post_dds",
           .about = "posts over DDS beside a bare Cyclone DDS one-way",
           .picture = {.title = "Post of an external event over DDS",
                       .x = kPost,
                       .y = kPostsLonger,
                       .floor = "a bare Cyclone DDS one-way"},
           .turns = 2.4,
           .under_stress = false,
           .measure = &measure_post_dds},
      Part{.name = "post_rate",
           .about = "posts over DDS: acknowledged, and at full rate, beside bare Cyclone DDS",
           .picture = {},
           .turns = 6.2,
           .under_stress = false,
           .measure = &measure_post_rate},
      Part{.name = "post_many",
           .about = "posts over DDS of 50 clients, and beside floods",
           .picture = {},
           .turns = 1.5,
           .under_stress = false,
           .measure = &measure_post_many},
      Part{.name = "cost",
           .about = "CPU of the runtime per cycle beside the same loop without it",
           .picture = {},
           .turns = 4.8,
           .under_stress = false,
           .measure = &measure_cost},
      Part{.name = "scale",
           .about = "10, 100 and 1,000 tasks of mixed periods beside bare threads",
           .picture = {},
           .turns = 7.0,
           .under_stress = true,
           .measure = &measure_scale},
      Part{.name = "poll",
           .about = "polling the variables of 500 event tasks",
           .picture = {},
           .turns = 3.8,
           .under_stress = false,
           .measure = &measure_poll},
      Part{.name = "distributed_clock",
           .about = "a 1 ms task on the grid of a drifting, noisy reference clock",
           .picture =
               {.title = "Deviation of a 1 ms task from the grid of its reference clock",
                .x = "time since the first release (s)",
                .y = "deviation (magnitude, logarithmic)",
                .notes = {"The largest start of a stretch is the longest stall of the host in it; half of "
                          "the cycles start",
                          "within the median. The plan is corrected by up to 10 µs in each cycle."}},
           .turns = 1.1,
           .under_stress = true,
           .measure = &measure_distributed_clock},
      Part{.name = "pool",
           .about = "objects of the pool beside atomics, the C library's mutexes, sem_open and shm_open",
           .picture = {},
           .turns = 6.5,
           .under_stress = false,
           .measure = &measure_pool},
      Part{.name = "pool_deaths",
           .about = "the longest wait of a client of a large pool while others are killed",
           .picture = {},
           .turns = 1.5,
           .under_stress = false,
           .measure = &measure_pool_deaths},
      Part{.name = "blocks",
           .about = "blocks between two processes beside iceoryx, a Unix datagram socket and memcpy",
           .picture = {},
           .turns = 21.0,
           .under_stress = false,
           .measure = &measure_blocks},
      Part{.name = "start",
           .about = "start of plc-instance to its first cycle",
           .picture = {},
           .turns = 0.1,
           .under_stress = false,
           .measure = &measure_start},
  };
  return kParts;
}

}  // namespace plchost::bench
