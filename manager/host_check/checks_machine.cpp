#include <cstdint>
#include <optional>
#include <sstream>

#include <fmt/format.h>

#include "manager/host_check/checks.hpp"

namespace plchost::host_check {

namespace {

// Whether the processor says that a hypervisor runs it; nothing: it says neither.
std::optional<bool> runs_below_a_hypervisor(std::string_view cpu_info) {
  std::istringstream lines{std::string(cpu_info)};
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("flags")) return (line + " ").find(" hypervisor ") != std::string::npos;
  }
  return std::nullopt;
}

// How many thousandths of the time since boot the hypervisor has given to others.
std::optional<std::uint64_t> stolen_permille(const HostFiles& files) {
  constexpr int kSteal = 7;  // the eighth number: user nice system idle iowait irq softirq steal
  const auto stat = files.text("/proc/stat");
  if (!stat || !stat->starts_with("cpu ")) return std::nullopt;
  std::istringstream numbers(stat->substr(4, stat->find('\n')));
  std::uint64_t sum = 0;
  std::uint64_t stolen = 0;
  for (int i = 0; i <= kSteal; ++i) {
    if (!(numbers >> stolen)) return std::nullopt;
    sum += stolen;
  }
  constexpr std::uint64_t kMille = 1000;
  return sum == 0 ? 0 : stolen * kMille / sum;
}

}  // namespace

HostFinding machine(const CheckedHost& host) {
  constexpr auto kSubject = "machine";
  constexpr auto kWhy = "a hypervisor stops a core whenever it wants, for ms: no setting in here prevents it";
  const auto info = host.files.text("/proc/cpuinfo");
  if (!info) return unknown(kSubject, info.error(), kWhy);
  const auto virtual_machine = runs_below_a_hypervisor(*info);
  if (!virtual_machine) {
    return unknown(kSubject, {ErrorCode::unsupported, 0, "/proc/cpuinfo has no flags on this architecture"},
                   kWhy);
  }
  if (!*virtual_machine) {
    return finding(FindingLevel::ok, kSubject,
                   "no hypervisor; how often its firmware interrupts (SMI) is not known from here", kWhy,
                   "measure with: hwlatdetect --duration=60");
  }
  const auto stolen = stolen_permille(host.files);
  constexpr double kTen = 10.0;
  return finding(
      FindingLevel::note, kSubject,
      stolen ? fmt::format("a virtual machine; {:.1f} % of its time since boot went to others (steal)",
                           static_cast<double>(*stolen) / kTen)
             : std::string("a virtual machine; how much of its time goes to others is not known"),
      kWhy, "give it cores of its own in the hypervisor, or use a machine without one");
}

HostFinding container(const CheckedHost& host) {
  constexpr auto kSubject = "container";
  constexpr auto kWhy =
      "a container has the kernel, interrupts and idle states of the machine that it runs on";
  std::string mark = container_mark(host.files);
  if (mark.empty() && has_its_own_processes(host.files)) mark = "its PID namespace";
  if (mark.empty()) return finding(FindingLevel::ok, kSubject, "none", kWhy);
  return finding(FindingLevel::note, kSubject, fmt::format("{} says that this is one", mark), kWhy,
                 "outside: set up the kernel, and give the container its rights, cores and /dev/shm "
                 "(manager/install.md, Containers)");
}

}  // namespace plchost::host_check
