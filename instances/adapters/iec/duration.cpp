#include "instances/adapters/iec/duration.hpp"

#include <fmt/format.h>

#include "instances/adapters/iec/tokens.hpp"
#include "shm/variables/time_text.hpp"

namespace plchost::iec {

std::expected<std::int64_t, std::string> nanoseconds_of(std::string_view literal) {
  const std::size_t sharp = literal.find('#');
  const std::string type = folded(literal.substr(0, sharp));
  if (sharp != std::string_view::npos && (type == "T" || type == "TIME" || type == "LT" || type == "LTIME")) {
    if (const auto parsed = parse_time(TimeForm::duration, literal.substr(sharp + 1))) return *parsed;
  }
  return std::unexpected(
      fmt::format("'{}' is not a duration; allowed is T#20ms, with the units d, h, m, s, ms, us, ns, up to "
                  "292 years",
                  literal));
}

}  // namespace plchost::iec
