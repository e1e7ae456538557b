#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>
#include <vector>

#include "shm/variables/variable_type.hpp"

// Any bytes are a value with a text; a text that is accepted comes back from its value with the same text.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace plchost;
  if (size == 0) return 0;
  const auto types = variable_types();
  const VariableTypeTraits& type = types[data[0] % types.size()];
  const std::string_view text(reinterpret_cast<const char*>(data) + 1, size - 1);
  const auto bytes = std::as_bytes(std::span(data, size)).subspan(1);
  constexpr std::size_t kString = 300;
  std::vector<std::byte> value(type.bytes != 0 ? type.bytes : kString);
  if (bytes.size() >= type.bytes) {
    const auto shown = variable_text(type.type, type.bytes != 0 ? bytes.first(type.bytes) : bytes);
    if (shown.size() > 255) std::abort();
  }
  if (!parse_variable(type.type, text, value)) return 0;
  const std::string once = variable_text(type.type, value, 4 * kString);
  if (!parse_variable(type.type, once, value)) std::abort();
  if (variable_text(type.type, value, 4 * kString) != once) std::abort();
  return 0;
}
