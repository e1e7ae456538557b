// [Sandbox]: the rights that the process of the instance gives up.
#include <array>
#include <utility>

#include "instances/runtime/settings/setting_places.hpp"
#include "instances/runtime/settings/settings_key.hpp"

namespace plchost {

namespace {

constexpr std::string_view kSandbox = "Sandbox";

// In the order of its enumerators.
constexpr std::array<std::string_view, 3> kSeccompWords = {"Off", "NoExec", "NoSockets"};
static_assert(std::to_underlying(Seccomp::no_sockets) == 2);

constexpr std::array kSandboxKeys = {
    SettingKey{.section = kSandbox,
               .name = "Seccomp",
               .meaning = "NoExec: no system calls that start programs or change the host. NoSockets: no new "
                          "sockets, too",
               .value = word_setting<At<&InstanceSettings::seccomp>>(kSeccompWords)},
};

}  // namespace

std::span<const SettingKey> sandbox_keys() noexcept {
  return kSandboxKeys;
}

}  // namespace plchost
