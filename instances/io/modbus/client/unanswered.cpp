#include "instances/io/modbus/client/unanswered.hpp"

#include <algorithm>
#include <cstdint>

namespace plchost::modbus {

namespace {

constexpr std::uint32_t kOneByte = 8;

bool fits_any(const ResponseShape& request) {
  return request.function == 0;
}

RegisterMap less_of(RegisterMap map) {
  map.count = is_bit(map.kind) ? std::min(map.count, kOneByte) : std::max(map.count - 1, 1U);
  return map;
}

RegisterMap more_of(RegisterMap map) {
  const std::uint32_t most = is_bit(map.kind) ? kMaxReadBits : kMaxReadRegisters;
  map.count = std::min(map.count + (is_bit(map.kind) ? kOneByte : 1), most);
  map.address = static_cast<std::uint16_t>(std::min(std::uint32_t{map.address}, kRegisterSpace - map.count));
  return map;
}

// Maps come before what nobody has configured. A device that has one register only need not be asked for two:
// there is nothing else that its values could be.
std::vector<RegisterMap> choices(const std::vector<RegisterMap>& reads) {
  std::vector<RegisterMap> all = reads;
  std::ranges::transform(reads, std::back_inserter(all), less_of);
  if (reads.size() > 1) std::ranges::transform(reads, std::back_inserter(all), more_of);
  return all;
}

}  // namespace

Unanswered Unanswered::of_process_before() {
  Unanswered unknown;
  unknown.requests_.resize(kOfProcessBefore);
  return unknown;
}

void Unanswered::given_up(ResponseShape shape) {
  requests_.push_back(shape);
  if (requests_.size() > kMost) requests_.pop_front();
}

template <class Fits>
void Unanswered::settle(ResponseShape shape, const Fits& fits) {
  const auto first = std::ranges::find_if(
      requests_, [&](const ResponseShape& request) { return fits_any(request) || fits(request); });
  const bool is_sure = first == requests_.end();
  requests_.erase(requests_.begin(), is_sure ? first : first + 1);
  if (!is_sure) requests_.push_back(shape);
}

void Unanswered::answered(ResponseShape shape) {
  settle(shape, [&](const ResponseShape& request) { return request == shape; });
}

void Unanswered::refused(ResponseShape shape) {
  settle(shape, [&](const ResponseShape& request) { return request.function == shape.function; });
}

bool Unanswered::may_come(ResponseShape shape) const {
  return std::ranges::any_of(
      requests_, [&](const ResponseShape& request) { return fits_any(request) || request == shape; });
}

std::optional<RegisterMap> Unanswered::probe(const std::vector<RegisterMap>& reads) const {
  const std::vector<RegisterMap> all = choices(reads);
  for (const RegisterMap& map : all) {
    if (!may_come(read_shape(map))) return map;
  }
  const bool has_others = std::ranges::any_of(
      all, [&](const RegisterMap& map) { return read_shape(map) != read_shape(all.front()); });
  if (!has_others) return std::nullopt;
  // One shape alone moves all others out, each response at least one of them. The shortest takes the least
  // time.
  const auto last = std::ranges::find(all, requests_.back(), read_shape);
  if (last != all.end()) return *last;
  return *std::ranges::min_element(all, {}, [](const RegisterMap& map) { return read_shape(map).size; });
}

}  // namespace plchost::modbus
