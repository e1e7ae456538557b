#include "api/dds/code_names.hpp"

#include <array>
#include <span>
#include <string_view>

#include <status_fields.hpp>

namespace plchost::dds {

namespace {

constexpr std::array kApplicationStates{std::string_view("none"),     std::string_view("stopped"),
                                        std::string_view("running"),  std::string_view("single_cycle"),
                                        std::string_view("stopping"), std::string_view("exception")};
constexpr std::array kLogLevels{std::string_view("debug"), std::string_view("info"),
                                std::string_view("warning"), std::string_view("error")};
constexpr std::array kLogSources{std::string_view("runtime"), std::string_view("application"),
                                 std::string_view("output"), std::string_view("manager")};

std::string code_name(std::span<const std::string_view> names, std::uint32_t number) {
  return number < names.size() ? std::string(names[number]) : std::to_string(number);
}

// The word for a code of a member, as control.idl has it.
template <class Sample>
std::string word_of(std::string_view member, std::uint32_t code) {
  std::string word;
  visit_fields(Sample{}, [&](const FieldInfo& field, const auto& /*value*/) {
    if (field.name == member) word = word_for(field.words, code);
  });
  return word;
}

}  // namespace

std::string instance_state_name(std::uint32_t state) {
  return word_of<plc_InstanceStatus>("state", state);
}

std::string transition_state_name(std::uint32_t source, std::uint32_t state) {
  return source == 0 ? code_name(kApplicationStates, state) : instance_state_name(state);
}

std::string task_kind_name(std::uint32_t kind) {
  return word_of<plc_TaskStatus>("kind", kind);
}

std::string log_level_name(std::uint32_t level) {
  return code_name(kLogLevels, level);
}

std::string log_source_name(std::uint32_t source) {
  return code_name(kLogSources, source);
}

std::string restart_policy_name(std::uint32_t policy) {
  return word_of<plc_InstanceStatus>("restart_policy", policy);
}

std::string task_state_name(std::uint32_t state) {
  return word_of<plc_TaskStatus>("state", state);
}

}  // namespace plchost::dds
