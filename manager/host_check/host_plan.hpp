#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "manager/host_check/host_check.hpp"
#include "shm/base/result.hpp"

namespace plchost {

/// The first words of each file that plchost has made in /etc.
inline constexpr std::string_view kPlanMark = "# Made by plchost: ";

/// The places of a plan: no other file is ever written or removed.
struct PlanPlace {
  const char* path;
  const char* link = "";    ///< a symbolic link to there; empty: a file
  bool own_folder = false;  ///< the folder is for this file alone
};
enum class PlanPart : std::uint8_t { grub, sysctl, unit, unit_link, irqbalance, udev };
inline constexpr auto kPlanUnit = "plchost-tuning.service";
inline constexpr std::array kPlanPlaces = {
    PlanPlace{.path = "/etc/default/grub.d/plchost.cfg"},
    PlanPlace{.path = "/etc/sysctl.d/60-plchost.conf"},
    PlanPlace{.path = "/etc/systemd/system/plchost-tuning.service"},
    PlanPlace{.path = "/etc/systemd/system/multi-user.target.wants/plchost-tuning.service",
              .link = "../plchost-tuning.service"},
    PlanPlace{.path = "/etc/systemd/system/irqbalance.service.d/60-plchost.conf", .own_folder = true},
    PlanPlace{.path = "/etc/udev/rules.d/60-plchost.rules"},
};
[[nodiscard]] constexpr const PlanPlace& place_of(PlanPart part) noexcept {
  return kPlanPlaces.at(static_cast<std::size_t>(part));
}

/// The facts that a plan depends on. The settings of the running kernel are not among them: the plan is for
/// the next kernel, too, and it is the same before and after it was applied.
struct PlanFacts {
  std::vector<CheckedHost::Instance> instances = {};
  std::vector<int> online = {};    ///< cores, ascending
  std::vector<int> siblings = {};  ///< of the instances' cores, by hyper-threading
  bool has_grub = false;           ///< its update-grub is there
};
/// The program that puts the file for grub to use is there. `written`: the tree that the files are for.
[[nodiscard]] bool has_update_grub(const HostFiles& written);
/// `written`: the tree that the files of the plan are for. refused, not_found, corrupt: the cores that are on
/// line cannot be read.
[[nodiscard]] Result<PlanFacts> plan_facts(const CheckedHost& host, const HostFiles& written);

struct PlannedFile {
  PlanPart part = PlanPart::grub;
  std::string text;  ///< empty: a link
};
/// A host set up for its instances.
struct HostPlan {
  std::vector<int> isolated;
  std::vector<int> housekeeping;  ///< never empty
  std::string kernel_words;       ///< for the command line of the kernel
  std::vector<PlannedFile> files;
};

/// A pure function. not_found: no instance has a core. refused: an instance has the core that the kernel
/// needs.
[[nodiscard]] Result<HostPlan> plan_host(const PlanFacts& facts);

/// How a plan mends the finding of a check, or why no file can.
struct Fix {
  std::string_view check;
  std::array<std::string_view, 2> by = {};  ///< paths; both empty: none
  std::string_view text;                    ///< the settings in the files, or the reason
  bool of_manager = false;                  ///< it is about the rights of the manager's process
};
[[nodiscard]] std::span<const Fix> host_fixes() noexcept;

/// The words of another's file that set the same on the kernel's command line, as "isolcpus=": the kernel
/// takes the first of them, or none.
[[nodiscard]] std::vector<std::string> words_that_clash(std::string_view file);

/// A file that grub reads after that of the plan sets the kernel's command line without its value before.
[[nodiscard]] bool replaces_command_line(std::string_view file);

}  // namespace plchost
