#include "shm/variables/order_text.hpp"

#include <fmt/format.h>

namespace plchost {

namespace {

// No name has it.
constexpr std::string_view kValues = ": ";

}  // namespace

std::string order_text(std::string_view name, bool forces, std::string_view before, std::string_view now) {
  return fmt::format("'{}' is {}{}{} -> {}", name, forces ? "forced" : "written", kValues, before, now);
}

std::string_view without_values(std::string_view order_text) noexcept {
  return order_text.substr(0, order_text.find(kValues));
}

}  // namespace plchost
