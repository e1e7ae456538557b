#include "manager/fix_host.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <optional>
#include <sstream>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include "manager/host_check/checks.hpp"
#include "manager/host_check/host_plan.hpp"
#include "manager/host_check/plan_files.hpp"
#include "manager/system/child_process.hpp"
#include "shm/base/cpu_list.hpp"

namespace plchost {

namespace {

using State = PlanFiles::State;

constexpr auto kPath = "/usr/sbin:/usr/bin:/sbin:/bin";
constexpr std::array kProgramFolders = {"/usr/sbin/", "/usr/bin/", "/sbin/", "/bin/"};
constexpr auto kUpdateGrub = "update-grub";
constexpr auto kGrubConfig = "/boot/grub/grub.cfg";
constexpr auto kFirstEnvironment = "/proc/1/environ";

using Words = std::vector<std::string>;

// Also if nobody can read it: the work goes on, and fix_host() looks at the stream at the end.
template <typename... Parts>
void say(fmt::format_string<Parts...> form, Parts&&... parts) {
  const std::string text = fmt::format(form, std::forward<Parts>(parts)...);
  (void)std::fwrite(text.data(), 1, text.size(), stdout);
}

bool fail(const std::string& text) {
  (void)std::fflush(stdout);
  (void)std::fputs(("plchostd: " + text + "\n").c_str(), stderr);
  return false;
}

std::optional<std::string> program_path(const std::string& name) {
  if (name.starts_with('/')) return HostFiles().exists(name) ? std::optional(name) : std::nullopt;
  for (const char* const folder : kProgramFolders) {
    if (std::string path = folder + name; ::access(path.c_str(), X_OK) == 0) return path;
  }
  return std::nullopt;
}

bool needs_systemd(const Words& command) {
  return command.front() == "systemctl" || command.front() == "udevadm";
}

Result<ExitStatus> run(Words command, const std::string& path) {
  command.front() = path;
  PLCHOST_TRY_ASSIGN(const auto child, spawn_process({.arguments = command}));
  pollfd end{.fd = child.pidfd.get(), .events = POLLIN, .revents = 0};
  while (::poll(&end, 1, -1) < 0 && errno == EINTR) {
  }
  return reap_process(child);
}

// True: none of them has failed. One that is not here has nothing to do.
bool run_all(const std::vector<Words>& commands) {
  // Nothing of the caller's environment: root runs these.
  ::clearenv();
  ::setenv("PATH", kPath, 1);
  const bool systemd = HostFiles().exists("/run/systemd/system");
  bool good = true;
  for (const Words& command : commands) {
    const std::string shown = fmt::format("{}", fmt::join(command, " "));
    const auto path = program_path(command.front());
    if (!path || (needs_systemd(command) && !systemd)) {
      say("not run: {}: {}\n", shown, path ? "systemd does not run" : "there is no such program");
      continue;
    }
    (void)std::fflush(stdout);
    const auto ended = run(command, *path);
    if (ended && ended->success()) {
      say("ran: {}\n", shown);
    } else {
      good = fail(fmt::format("{}: {}", shown, ended ? ended->describe() : ended.error().describe()));
    }
  }
  return good;
}

// To apply and to revert: rules, units, and irqbalance where it is installed.
std::vector<Words> commands_to_reload(const HostFiles& written) {
  std::vector<Words> commands = {{"udevadm", "control", "--reload"}, {"systemctl", "daemon-reload"}};
  if (written.exists("/lib/systemd/system/irqbalance.service"))
    commands.push_back({"systemctl", "try-restart", "irqbalance.service"});
  return commands;
}

// The program of systemd, as sysctl fails for each setting that the kernel does not have.
std::vector<Words> commands_to_apply(const HostFiles& written) {
  auto commands = commands_to_reload(written);
  commands.push_back({"systemctl", "restart", kPlanUnit});
  commands.push_back({"/lib/systemd/systemd-sysctl", place_of(PlanPart::sysctl).path});
  return commands;
}

void print_commands(const std::vector<Words>& commands, std::string_view when) {
  for (const Words& command : commands) say("{}: {}\n", when, fmt::join(command, " "));
}

void print_text(const std::string& text) {
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) say("    {}\n", line);
}

// Each finding that is not good: the files that mend it, or the reason that none does.
void print_fixes(const CheckedHost& host, bool has_grub) {
  std::string of_manager;
  for (const HostFinding& finding : check_host(host)) {
    const Fix& fix = *std::ranges::find(host_fixes(), finding.id, &Fix::check);  // each has one
    if (fix.of_manager) of_manager += (of_manager.empty() ? "" : ", ") + finding.id;
    if (fix.of_manager || finding.level == FindingLevel::ok) continue;
    std::string by;
    for (const std::string_view path : fix.by) {
      if (path.empty()) continue;
      const bool by_hand = path == place_of(PlanPart::grub).path && !has_grub;
      by += fmt::format("{}{}", by.empty() ? "" : " and ", by_hand ? "the command line of the kernel" : path);
    }
    say("{:<19} {}: {}\n", finding.id, by.empty() ? "no file of plchost changes it" : by, fix.text);
  }
  say("not looked at: {}: plchostd.service gives the manager its rights, see 'plcctl check host'\n",
      of_manager);
}

std::unexpected<Error> unreadable_of_grub(const std::string& root, const Error& error) {
  return failure(ErrorCode::refused,
                 fmt::format("cannot read what grub reads: {}{}", root, error.describe()));
}

// The files of others that grub reads, too.
Result<void> look_at_grub(const HostFiles& written, const std::string& root) {
  const std::string own = place_of(PlanPart::grub).path;
  std::vector<std::string> others = {"/etc/default/grub"};
  const auto names = written.names("/etc/default/grub.d");
  if (!names && names.error().code != ErrorCode::not_found) return unreadable_of_grub(root, names.error());
  for (const std::string& name : names.value_or(std::vector<std::string>())) {
    const std::string path = "/etc/default/grub.d/" + name;
    if (path.ends_with(".cfg") && path != own) others.push_back(path);
  }
  for (const std::string& path : others) {
    const auto text = written.text(path);
    if (!text && text.error().code == ErrorCode::not_found) continue;
    if (!text) return unreadable_of_grub(root, text.error());
    if (const auto words = words_that_clash(*text); !words.empty()) {
      return failure(ErrorCode::refused,
                     fmt::format("{}{} has {} too, and the kernel would not take both; take it out there",
                                 root, path, fmt::join(words, " ")));
    }
    // The shell of grub-mkconfig sorts by bytes.
    if (path > own && replaces_command_line(*text)) {
      return failure(ErrorCode::refused,
                     fmt::format("{}{} sets GRUB_CMDLINE_LINUX_DEFAULT after plchost.cfg and drops its "
                                 "words; put $GRUB_CMDLINE_LINUX_DEFAULT into the value there",
                                 root, path));
    }
  }
  return {};
}

// The first reason for which nothing may be written.
Result<std::vector<State>> look(const PlanFiles& files, const HostPlan& plan, const HostFiles& written,
                                const std::string& root) {
  std::vector<State> states;
  for (const PlannedFile& file : plan.files) {
    PLCHOST_TRY_ASSIGN(const auto state, files.state(file));
    states.push_back(state);
  }
  if (plan.files.front().part != PlanPart::grub) return states;
  PLCHOST_TRY(look_at_grub(written, root));
  return states;
}

std::string_view word_of(State state) {
  if (state == State::same) return "is there";
  return state == State::missing ? "new" : "changed";
}

bool runs_with(const std::string& words) {
  const std::string line = " " + HostFiles().text("/proc/cmdline").value_or("") + " ";
  std::istringstream each(words);
  for (std::string word; each >> word;) {
    if (line.find(" " + word + " ") == std::string::npos) return false;
  }
  return true;
}

void print_by_hand(std::string_view why, const HostPlan& plan) {
  say("by hand: {}: let the boot loader give the kernel: {}\n", why, plan.kernel_words);
}

void print_kernel_words(const HostPlan& plan, const FixOrder& order, bool has_grub) {
  if (order.root.empty() && runs_with(plan.kernel_words)) {
    say("the kernel runs with these words: {}\n", plan.kernel_words);
  } else if (!has_grub) {
    print_by_hand("there is no update-grub", plan);
  } else {
    say("after update-grub, {}: {}\n", order.root.empty() ? "with a reboot" : "at the boot of the image",
        plan.kernel_words);
  }
}

// A line as "linux /vmlinuz root=/dev/sda1 ro quiet isolcpus=..." of any entry. The file may be longer than
// HostFiles reads.
bool grub_gives(const std::string& words) {
  std::ifstream file(kGrubConfig);
  for (std::string line; std::getline(file, line);) {
    const std::size_t start = line.find_first_not_of(" \t");
    if (start == std::string::npos || !line.substr(start).starts_with("linux")) continue;
    if ((line + " ").find(" " + words + " ") != std::string::npos) return true;
  }
  return false;
}

// False: the next boot does not give the kernel its words, although there is grub.
bool boot_with_words(const HostPlan& plan, const FixOrder& order) {
  if (!run_all({{kUpdateGrub}})) {
    print_by_hand("update-grub has failed", plan);
    return false;
  }
  if (!grub_gives(plan.kernel_words)) {
    print_by_hand("grub does not do it", plan);
    return fail(
        fmt::format("after update-grub {} does not have these words; look in /etc/default/grub and "
                    "grub.d for a file that changes GRUB_CMDLINE_LINUX_DEFAULT",
                    kGrubConfig));
  }
  if (runs_with(plan.kernel_words)) {
    print_kernel_words(plan, order, true);
  } else {
    say("with a reboot: {}\n", plan.kernel_words);
  }
  return true;
}

bool apply(const FixOrder& order, const HostPlan& plan, const std::vector<State>& states,
           const PlanFacts& facts) {
  const PlanFiles files(order.root);
  for (std::size_t i = 0; i < plan.files.size(); ++i) {
    const std::string path = order.root + place_of(plan.files[i].part).path;
    if (states[i] != State::same) {
      if (const auto written = files.write(plan.files[i]); !written)
        return fail(written.error().describe() + "; the files above are written, --apply goes on there");
    }
    say("{}: {}\n", states[i] == State::same ? "is there" : "written", path);
  }
  const auto commands = commands_to_apply(HostFiles(order.root));
  if (order.root.empty()) {
    const bool good = run_all(commands);
    if (facts.has_grub) return boot_with_words(plan, order) && good;
    print_kernel_words(plan, order, false);
    return good;
  }
  if (::geteuid() != 0)
    say("to do in it: the files belong to user {}: make them root's, with chown root:root\n", ::geteuid());
  print_commands(commands, "to run in it");
  if (facts.has_grub) print_commands({{kUpdateGrub}}, "to run in it");
  print_kernel_words(plan, order, facts.has_grub);
  return true;
}

bool revert(const FixOrder& order) {
  const PlanFiles files(order.root);
  bool good = true;
  bool any = false;
  // As long as it has its file: it may not be loaded yet.
  const auto unit = files.state({PlanPart::unit, {}});
  if (unit && *unit != State::missing && order.root.empty())
    good = run_all({{"systemctl", "stop", kPlanUnit}});
  for (std::size_t i = kPlanPlaces.size(); i-- > 0;) {
    const auto part = static_cast<PlanPart>(i);
    const auto removed = files.remove(part);
    if (!removed) good = fail("left as it is: " + removed.error().describe());
    if (!removed || !*removed) continue;
    say("removed: {}{}\n", order.root, kPlanPlaces[i].path);
    any = true;
  }
  if (!any) say("plchost has no file here\n");
  // Also without a file: one before may have been cut here.
  const HostFiles written(order.root);
  auto commands = commands_to_reload(written);
  if (has_update_grub(written)) commands.push_back({kUpdateGrub});
  if (!order.root.empty()) {
    print_commands(commands, "to run in it");
  } else if (!run_all(commands)) {
    return fail("the files are removed, but not all programs have run well; --revert again runs them anew");
  }
  say("with a reboot: the command line of the kernel, sysctl, interrupts, work queues, huge pages and "
      "governors are as they were; until then all of them stay\n");
  return good;
}

// By the environment of its first process: a folder of an image may have the /proc of the machine that builds
// it.
bool container_by_environment() {
  std::ifstream file(kFirstEnvironment, std::ios::binary);
  for (std::string word; std::getline(file, word, '\0');) {
    if (word.starts_with("container=")) return true;
  }
  return false;
}

std::string container_mark(const FixOrder& order) {
  if (std::string mark = host_check::container_mark(HostFiles(order.root)); !mark.empty()) return mark;
  if (!order.root.empty()) return "";
  if (container_by_environment()) return kFirstEnvironment;
  return host_check::has_its_own_processes(HostFiles()) ? "its PID namespace" : "";
}

bool do_order(const FixOrder& order, const ManagerConfig& config) {
  const bool writes = order.mode != FixMode::print;
  const HostFiles written(order.root);
  if (order.mode == FixMode::revert) return revert(order);
  const std::string mark = container_mark(order);
  if (writes && !mark.empty()) {
    return fail(fmt::format("{}{} says that this is a container: its kernel is set up outside, on the host",
                            order.root, mark));
  }
  CheckedHost host = this_host(config);
  host.files = facts_below(order.root);
  const auto facts = plan_facts(host, written);
  if (!facts) return fail(facts.error().describe());
  const auto plan = plan_host(*facts);
  if (!plan) return fail(plan.error().describe());
  const PlanFiles files(order.root);
  const auto states = look(files, *plan, written, order.root);
  say("{}; cores {} for all the rest\n", host_check::name_cores(host, host_check::plc_cores(host)),
      format_cpu_list(plan->housekeeping));
  if (!states) return fail(states.error().describe());
  if (writes) return apply(order, *plan, *states, *facts);
  for (std::size_t i = 0; i < plan->files.size(); ++i) {
    const PlannedFile& file = plan->files[i];
    say("{}: {}{}\n", word_of((*states)[i]), order.root, place_of(file.part).path);
    if ((*states)[i] != State::same) print_text(file.text);
  }
  print_fixes(host, facts->has_grub);
  print_commands(commands_to_apply(written), "to run");
  if (facts->has_grub) print_commands({{kUpdateGrub}}, "to run");
  print_kernel_words(*plan, order, facts->has_grub);
  if (!mark.empty()) {
    say("{}{} says that this is a container: all of this has to be done outside, on the host\n", order.root,
        mark);
  } else if (order.root.empty() && ::geteuid() != 0) {
    say("--apply does it, and needs root\n");
  }
  return true;
}

}  // namespace

Result<void> may_fix_host(const FixOrder& order) {
  if (order.mode == FixMode::print || !order.root.empty() || ::geteuid() == 0) return {};
  return failure(ErrorCode::refused, "only root may write in /etc: run it as root, or with sudo");
}

HostFiles facts_below(const std::string& root) {
  return HostFiles(HostFiles(root).exists("/sys/devices/system/cpu/online") ? root : std::string());
}

bool fix_host(const FixOrder& order, const ManagerConfig& config) {
  const bool done = do_order(order, config);
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return done;
  return fail("cannot write to the standard output");
}

}  // namespace plchost
