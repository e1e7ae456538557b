// [ComponentManager]: the libraries that are loaded before the application.
#include <array>

#include "instances/runtime/settings/settings_key.hpp"

namespace plchost {

namespace {

constexpr std::string_view kComponentSection = "ComponentManager";

bool add_component(const SettingsTarget& to, std::size_t number, std::string_view component) {
  to.components.insert_or_assign(
      number, is_foreign_component(component) ? std::string(component) : in_folder(to, component));
  return true;
}

constexpr std::array kComponentKeys = {
    SettingKey{
        .section = kComponentSection,
        .name = "Component.N",
        .meaning = "component with HookFunction; loaded in the order of N",
        .value = NumberedSetting{"file of a shared object, with a '/' or a '.' in its name", add_component}},
    SettingKey{.section = kComponentSection, .name = "DisablingOperations"},
    SettingKey{.section = kComponentSection, .name = "MinimalCommCycleHookInterval"},
    SettingKey{.section = kComponentSection, .name = "OverloadableFunctions"},
    SettingKey{.section = kComponentSection, .name = "Profiler.ComponentID"},
    SettingKey{.section = kComponentSection, .name = "WinCE.CommCycleInterval"},
    SettingKey{.section = kComponentSection, .name = "WinCE.CommCycleThreadPriority"},
    SettingKey{.section = kComponentSection, .name = "WindowHided"},
};

}  // namespace

// Ours are files; theirs are plain names of what is built into their runtime, "CmpBACnet".
bool is_foreign_component(std::string_view component) {
  return component.find_first_of("/.") == std::string_view::npos;
}

std::span<const SettingKey> component_keys() noexcept {
  return kComponentKeys;
}

}  // namespace plchost
