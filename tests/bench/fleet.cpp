// API servers in one DDS domain, each on a host of its own without instances, and a viewer at a desk. The
// time until it has seen all of them, and of commands. In rest memory, traffic and processor time.

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <thread>

#include <fcntl.h>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "shm/base/system_call.hpp"
#include "tests/bench/fleet_hosts.hpp"
#include "tests/bench/fleet_network.hpp"
#include "tests/bench/parts.hpp"
#include "tests/bench/process_usage.hpp"
#include "tests/support/own_name.hpp"

namespace plchost::bench {

namespace {

constexpr int kSmallFleet = 8;         // measured beside the large one, for the scale
constexpr int kCommandsOfStarts = 6;   // one look and one command of each kind for so many starts of the plan
constexpr int kPatienceSeconds = 120;  // until all hosts are there
constexpr Duration kRestLook = std::chrono::seconds(1);
constexpr int kRestLooks = 60;
constexpr double kFewDatagrams = 10;  // announcements that fall into one second or into the next

/// The processes of a host, as the host shows them.
struct HostProcesses {
  pid_t server = 0;
  pid_t manager = 0;
};

double median(std::vector<double> values) {
  if (values.empty()) return kNotMeasured;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

double to_seconds(Duration time) {
  return std::chrono::duration<double>(time).count();
}

/// One fleet: its hosts run as long as this exists.
class Fleet {
 public:
  Fleet(const Plan& plan, int hosts)
      : plan_(plan),
        count_(hosts),
        name_(own_name("f")),
        folder_(std::filesystem::temp_directory_path() / name_),
        hosts_(folder_, name_) {
    std::filesystem::create_directories(folder_);
  }

  Result<void> start() {
    PLCHOST_TRY_ASSIGN(auto network, FleetNetwork::create(count_, folder_));
    network_.emplace(std::move(network));
    return hosts_.start(plan_, *network_, count_);
  }

  Result<std::vector<Row>> measure() {
    const TimePoint started = MonotonicClock::now();
    PLCHOST_TRY(discover());
    const Duration all_there = MonotonicClock::now() - started;
    PLCHOST_TRY(settle(network_->host(0)));
    std::vector<Row> rows;
    PLCHOST_TRY_ASSIGN(auto discovery, measure_discovery());
    discovery.extra.emplace_back("seen_after_last_start_ms", to_us(all_there) / 1e3);
    rows.push_back(std::move(discovery));
    PLCHOST_TRY_ASSIGN(auto listed, measure_list_hosts());
    rows.push_back(std::move(listed));
    PLCHOST_TRY_ASSIGN(auto asked,
                       measure_command("list_instances_of_one", {"--host", first(), "list", "instances"}));
    rows.push_back(std::move(asked));
    PLCHOST_TRY_ASSIGN(auto host, measure_host());
    rows.push_back(std::move(host));
    PLCHOST_TRY_ASSIGN(auto all, measure_viewer("viewer_of_all", {}));
    PLCHOST_TRY_ASSIGN(auto one, measure_viewer("viewer_of_one", {"--host", first()}));
    rows.push_back(std::move(all));
    rows.push_back(std::move(one));
    return rows;
  }

 private:
  static std::string first() { return fleet_host_name(0); }

  [[nodiscard]] int commands() const { return std::max(plan_.starts / kCommandsOfStarts, 1); }

  /// Long enough for what comes every second.
  [[nodiscard]] Duration rest() const { return std::max<Duration>(plan_.each / 2, std::chrono::seconds(1)); }

  [[nodiscard]] Row row(std::string_view what, std::string sample) const {
    return {.name = fmt::format("fleet/{}hosts/{}", count_, what), .sample = std::move(sample)};
  }

  /// A desk has processors of its own in a plant. Here the servers, which have real-time priorities, would
  /// leave it none while they all answer it.
  [[nodiscard]] std::vector<std::string> at_the_desk(std::string_view program,
                                                     std::vector<std::string> words) const {
    words.insert(words.begin(),
                 {"chrt", "-f", std::to_string(kPriority.fifo), (plan_.programs / program).string()});
    return words;
  }

  [[nodiscard]] std::vector<std::string> plcctl(std::vector<std::string> words) const {
    words.insert(words.begin(),
                 {"--domain", std::to_string(kFleetDomain), "--interface", std::string(kCable)});
    return at_the_desk("plcctl", std::move(words));
  }

  /// By a client at the desk that starts now: its time until it has seen all hosts.
  Result<Duration> discover() {
    PLCHOST_TRY_ASSIGN(const auto within, network_->desk().enter());
    PLCHOST_TRY_ASSIGN(const auto text,
                       output_of(at_the_desk("plchost-bench-viewer",
                                             {std::to_string(kFleetDomain), std::string(kCable),
                                              std::to_string(count_), std::to_string(kPatienceSeconds)})));
    Duration::rep all = 0;
    const auto space = text.find(' ') + 1;
    if (std::from_chars(text.data() + space, text.data() + text.size(), all).ec != std::errc())
      return failure(ErrorCode::corrupt, fmt::format("plchost-bench-viewer said '{}'", text));
    return Duration(all);
  }

  /// Until two seconds that follow each other have the same traffic, but for a tenth or ten datagrams.
  Result<void> settle(const NetworkSpace& machine) {
    double last = 0;
    PLCHOST_TRY_ASSIGN(Traffic before, machine.traffic(kCable));
    for (int look = 0; look < kRestLooks; ++look) {
      std::this_thread::sleep_for(kRestLook);
      PLCHOST_TRY_ASSIGN(const Traffic now, machine.traffic(kCable));
      const double datagrams = (now - before).received_datagrams;
      if (look > 0 && std::abs(datagrams - last) <= std::max(last / 10, kFewDatagrams)) return {};
      last = datagrams;
      before = now;
    }
    return failure(ErrorCode::timed_out, fmt::format("the traffic of {} hosts does not settle", count_));
  }

  Result<Row> measure_discovery() {
    Row result = row("discovery", "a viewer's start");
    for (int i = 0; i < commands(); ++i) {
      PLCHOST_TRY_ASSIGN(const Duration all, discover());
      result.ours.push(all);
    }
    return result;
  }

  /// A command at the desk, with the options that it has by default.
  Result<std::string> time_command(const std::vector<std::string>& words, Samples& into) {
    PLCHOST_TRY_ASSIGN(const auto within, network_->desk().enter());
    const TimePoint began = MonotonicClock::now();
    PLCHOST_TRY_ASSIGN(auto text, output_of(plcctl(words)));
    into.push(MonotonicClock::now() - began);
    return text;
  }

  Result<Row> measure_command(std::string_view what, const std::vector<std::string>& words) {
    Row result = row(what, "a command");
    for (int i = 0; i < commands(); ++i) {
      PLCHOST_TRY(time_command(words, result.ours));
    }
    return result;
  }

  Result<Row> measure_list_hosts() {
    Row result = row("list_hosts", "a command");
    double most_missing = 0;
    for (int i = 0; i < commands(); ++i) {
      PLCHOST_TRY_ASSIGN(const auto text, time_command({"list", "hosts", "--json"}, result.ours));
      const auto hosts = nlohmann::json::parse(text, nullptr, false);
      if (!hosts.is_array()) return failure(ErrorCode::corrupt, "plcctl list hosts: no array");
      const auto alive =
          std::ranges::count_if(hosts, [](const auto& host) { return host.value("state", "") == "alive"; });
      most_missing = std::max(most_missing, static_cast<double>(count_ - alive));
      if (alive == count_) remember(hosts);
    }
    result.targets = {{"every list shows all hosts", "hosts missing", most_missing, 0, true}};
    return result;
  }

  void remember(const nlohmann::json& hosts) {
    processes_.clear();
    for (const auto& host : hosts)
      processes_.push_back({.server = host.value("server_pid", 0), .manager = host.value("manager_pid", 0)});
  }

  /// Of each: the servers', or the managers', processor time.
  Result<Duration> processor_time(pid_t HostProcesses::* which) const {
    Duration sum{};
    for (const HostProcesses& host : processes_) {
      PLCHOST_TRY_ASSIGN(const Duration one, processor_time_of(host.*which));
      sum += one;
    }
    return sum;
  }

  Result<void> add_memory(Row& result, std::string_view name, pid_t HostProcesses::* which) const {
    std::vector<double> rss;
    std::vector<double> pss;
    for (const HostProcesses& host : processes_) {
      PLCHOST_TRY_ASSIGN(const auto memory, memory_of(host.*which));
      rss.push_back(memory.rss_mib);
      pss.push_back(memory.pss_mib);
    }
    result.extra.emplace_back(fmt::format("{}_rss_mib", name), median(rss));
    result.extra.emplace_back(fmt::format("{}_pss_mib", name), median(pss));
    return {};
  }

  static void add_traffic(Row& result, const Traffic& traffic, Duration time) {
    const double seconds = to_seconds(time);
    result.extra.emplace_back("received_bytes_per_second", traffic.received_bytes / seconds);
    result.extra.emplace_back("received_datagrams_per_second", traffic.received_datagrams / seconds);
    result.extra.emplace_back("sent_bytes_per_second", traffic.sent_bytes / seconds);
    result.extra.emplace_back("sent_datagrams_per_second", traffic.sent_datagrams / seconds);
  }

  /// While no client is there.
  Result<Row> measure_host() {
    Row result = row("host", "");
    if (processes_.empty()) {
      result.note = "not measured: no list showed all hosts";
      return result;
    }
    PLCHOST_TRY(settle(network_->host(0)));
    PLCHOST_TRY_ASSIGN(const Traffic before, network_->host(0).traffic(kCable));
    PLCHOST_TRY_ASSIGN(const Duration servers, processor_time(&HostProcesses::server));
    PLCHOST_TRY_ASSIGN(const Duration managers, processor_time(&HostProcesses::manager));
    const TimePoint began = MonotonicClock::now();
    std::this_thread::sleep_for(rest());
    PLCHOST_TRY_ASSIGN(const Traffic after, network_->host(0).traffic(kCable));
    PLCHOST_TRY_ASSIGN(const Duration servers_now, processor_time(&HostProcesses::server));
    PLCHOST_TRY_ASSIGN(const Duration managers_now, processor_time(&HostProcesses::manager));
    const Duration time = MonotonicClock::now() - began;
    add_traffic(result, after - before, time);
    PLCHOST_TRY(add_memory(result, "server", &HostProcesses::server));
    PLCHOST_TRY(add_memory(result, "manager", &HostProcesses::manager));
    result.extra.emplace_back("all_servers_share_of_core",
                              to_seconds(servers_now - servers) / to_seconds(time));
    result.extra.emplace_back("all_managers_share_of_core",
                              to_seconds(managers_now - managers) / to_seconds(time));
    result.note = "no client is there; memory is the median of all hosts";
    return result;
  }

  Result<Row> measure_viewer(std::string_view what, std::vector<std::string> words) {
    words.insert(words.end(),
                 {"--timeout", std::to_string(kPatienceSeconds), "--watch", "list", "instances"});
    PLCHOST_TRY_ASSIGN(const int nowhere,
                       check_errno(::open("/dev/null", O_WRONLY | O_CLOEXEC), "open /dev/null"));
    const UniqueFd output(nowhere);
    Child viewer;
    {
      PLCHOST_TRY_ASSIGN(const auto within, network_->desk().enter());
      PLCHOST_TRY_ASSIGN(viewer, Child::start(plcctl(words), output.get()));
    }
    PLCHOST_TRY(settle(network_->desk()));
    PLCHOST_TRY_ASSIGN(const Traffic before, network_->desk().traffic(kCable));
    PLCHOST_TRY_ASSIGN(const Duration cpu, processor_time_of(viewer.pid()));
    const TimePoint began = MonotonicClock::now();
    std::this_thread::sleep_for(rest());
    PLCHOST_TRY_ASSIGN(const Traffic after, network_->desk().traffic(kCable));
    PLCHOST_TRY_ASSIGN(const Duration cpu_now, processor_time_of(viewer.pid()));
    const Duration time = MonotonicClock::now() - began;
    Row result = row(what, "");
    add_traffic(result, after - before, time);
    PLCHOST_TRY_ASSIGN(const auto memory, memory_of(viewer.pid()));
    result.extra.emplace_back("viewer_rss_mib", memory.rss_mib);
    result.extra.emplace_back("viewer_pss_mib", memory.pss_mib);
    result.extra.emplace_back("viewer_share_of_core", to_seconds(cpu_now - cpu) / to_seconds(time));
    result.note = "plcctl --watch list instances, in rest";
    return result;
  }

  const Plan& plan_;
  int count_;
  std::string name_;
  std::filesystem::path folder_;
  std::optional<FleetNetwork> network_;  // ends after the hosts
  FleetHosts hosts_;
  std::vector<HostProcesses> processes_;
};

Result<void> measure_fleet_of(const Plan& plan, int hosts, std::vector<Row>& into) {
  Fleet fleet(plan, hosts);
  PLCHOST_TRY(fleet.start());
  PLCHOST_TRY_ASSIGN(auto rows, fleet.measure());
  std::ranges::move(rows, std::back_inserter(into));
  return {};
}

Row skipped(std::string why) {
  return {.name = "fleet", .note = "skipped: " + std::move(why)};
}

}  // namespace

Result<std::vector<Row>> measure_fleet(const Plan& plan) {
  if (!is_installed("ip")) return std::vector{skipped("ip (Debian: iproute2) is not installed")};
  if (const auto space = NetworkSpace::create(); !space)
    return std::vector{skipped(space.error().describe())};
  std::vector<Row> rows;
  if (plan.hosts > kSmallFleet) {
    PLCHOST_TRY(measure_fleet_of(plan, kSmallFleet, rows));
  }
  PLCHOST_TRY(measure_fleet_of(plan, plan.hosts, rows));
  return rows;
}

}  // namespace plchost::bench
