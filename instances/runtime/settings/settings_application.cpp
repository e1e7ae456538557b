// [Application]: texts that the application asks for by their names.
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

}  // namespace plchost
