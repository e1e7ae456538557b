#pragma once

#include <cstdint>
#include <string>

namespace plchost::dds {

/// The words for the codes of control.idl. A newer host may know more: its number is shown. Any context.
[[nodiscard]] std::string instance_state_name(std::uint32_t state);
/// A state of Transition: its source says of which process.
[[nodiscard]] std::string transition_state_name(std::uint32_t source, std::uint32_t state);
[[nodiscard]] std::string log_level_name(std::uint32_t level);
[[nodiscard]] std::string log_source_name(std::uint32_t source);
[[nodiscard]] std::string finding_level_name(std::uint32_t level);

}  // namespace plchost::dds
