// [Application]: texts that the application asks for by their names. [ComponentManager]: the libraries that
// are loaded before it.
#include <array>

#include "instances/runtime/settings/settings_key.hpp"

namespace plchost {

namespace {

constexpr std::string_view kApplicationSection = "Application";

bool set_parameter(const SettingsTarget& to, std::string_view name, std::string_view text) {
  Parameters& parameters = to.settings.parameters;
  if (text.size() > kMaxParameterText) return false;
  if (parameters.size() == kMaxParameters && !parameters.contains(name)) return false;
  parameters.insert_or_assign(std::string(name), std::string(text));
  return true;
}

constexpr std::array kApplicationKeys = {
    SettingKey{.section = kApplicationSection,
               .name = "Parameter.NAME",
               .meaning = "the answer of plc_parameter() to this name",
               .value = NamedSetting{"a text of at most 500 bytes, at most 256 of them", set_parameter}},
};

}  // namespace

static_assert(kMaxParameterText == 500 && kMaxParameters == 256);  // as the form says

std::span<const SettingKey> application_keys() noexcept {
  return kApplicationKeys;
}

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
