// grid_phase PHC_FILE POOL INSTANCE TASK: prints how far the task's last planned release is from the grid of
// the simulated clock, in ns.
#include <cstdio>
#include <string_view>

#include "shm/pages/instance_page.hpp"
#include "tests/integration/instances/simulated_phc.hpp"

int main(int argc, char** argv) {
  if (argc != 5) return 2;
  const auto page = plchost::InstancePageReader::open(argv[2], argv[3]);
  for (std::uint32_t i = 0; page && i < page->task_count(); ++i) {
    const auto task = page->task(i);
    if (!task || task->identity.name.view() != std::string_view(argv[4])) continue;
    const auto phc = plchost::testing::SimulatedPhc::read(argv[1]);
    const auto phase = phc.phase_ns(task->counters.release_ns, task->identity.interval_ns);
    std::printf("%lld\n", static_cast<long long>(phase));
    return 0;
  }
  return 1;
}
