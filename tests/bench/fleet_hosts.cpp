#include "tests/bench/fleet_hosts.hpp"

#include <fstream>
#include <set>
#include <system_error>
#include <thread>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "tests/bench/process_usage.hpp"

namespace plchost::bench {

std::string fleet_host_name(int number) {
  return fmt::format("h{}", number + 1);
}

FleetHosts::~FleetHosts() {
  for (const Child& manager : managers_) manager.ask_to_end();
  managers_.clear();
  std::error_code ignored;
  std::filesystem::remove_all(folder_, ignored);
}

std::string FleetHosts::configure(const Plan& plan, int number) const {
  const std::string name = fleet_host_name(number);
  const auto own = [&](std::string_view kind) {
    return (folder_ / fmt::format("{}.{}", name, kind)).string();
  };
  const std::set cores{plan.poster_core, plan.task_core};
  std::ofstream(own("toml")) << fmt::format(
      "[host]\nname = \"{}\"\ndds_domain = {}\nrun_directory = \"{}\"\nstate_directory = \"{}\"\npool = "
      "\"{}{}\"\n"
      "cores = [{}]\nhousekeeping_cores = [{}]\nlog_level = \"error\"\n"
      "[dds]\ninterface = \"{}\"\nallow_unsecured = true\n",
      name, kFleetDomain, own("run"), own("state"), pools_, name, plan.task_core, fmt::join(cores, ", "),
      kCable);
  return own("toml");
}

namespace {

/// Until the processors have nothing to do for a third of a look, 1 s at most.
Result<void> wait_for_rest() {
  constexpr Duration kLook = std::chrono::milliseconds(250);
  constexpr int kLooks = 4;
  for (int look = 0; look < kLooks; ++look) {
    PLCHOST_TRY_ASSIGN(const Duration before, idle_time());
    std::this_thread::sleep_for(kLook);
    PLCHOST_TRY_ASSIGN(const Duration after, idle_time());
    if (after - before > kLook * std::thread::hardware_concurrency() / 3) break;
  }
  return {};
}

}  // namespace

Result<void> FleetHosts::start(const Plan& plan, const FleetNetwork& network, int hosts) {
  const std::string program = (plan.programs / "plchostd").string();
  for (int number = 0; number < hosts; ++number) {
    const std::string config = configure(plan, number);
    {
      PLCHOST_TRY_ASSIGN(const auto within, network.host(number).enter());
      PLCHOST_TRY_ASSIGN(auto manager, Child::start({program, "--config", config}));
      managers_.push_back(std::move(manager));
    }
    PLCHOST_TRY(wait_for_rest());
  }
  return {};
}

}  // namespace plchost::bench
