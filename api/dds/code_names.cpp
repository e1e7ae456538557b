#include "api/dds/code_names.hpp"

#include <code_words.hpp>

#include "api/dds/field_info.hpp"

namespace plchost::dds {

std::string instance_state_name(std::uint32_t state) {
  return word_for(words::InstanceStatus::state, state);
}

std::string transition_state_name(std::uint32_t source, std::uint32_t state) {
  return source == 0 ? word_for(words::Transition::from_state, state) : instance_state_name(state);
}

std::string log_level_name(std::uint32_t level) {
  return word_for(words::LogRecord::level, level);
}

std::string log_source_name(std::uint32_t source) {
  return word_for(words::LogRecord::source, source);
}

std::string finding_level_name(std::uint32_t level) {
  return word_for(words::HostFinding::level, level);
}

}  // namespace plchost::dds
