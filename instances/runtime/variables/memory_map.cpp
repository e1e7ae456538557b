#include "instances/runtime/variables/memory_map.hpp"

#include <algorithm>
#include <charconv>
#include <fstream>
#include <iterator>
#include <string>

namespace plchost {

Result<MemoryMap> MemoryMap::of_this_process() {
  std::ifstream file("/proc/self/maps");
  const std::string maps((std::istreambuf_iterator<char>(file)), {});
  if (maps.empty()) return failure(ErrorCode::system, "/proc/self/maps cannot be read: mount /proc");
  return parse(maps);
}

// "7f0c4a000000-7f0c4a021000 rw-p ..."
MemoryMap MemoryMap::parse(std::string_view maps) {
  constexpr int kHexadecimal = 16;
  MemoryMap map;
  while (!maps.empty()) {
    const std::string_view line = maps.substr(0, maps.find('\n'));
    maps.remove_prefix(std::min(line.size() + 1, maps.size()));
    Part part{.begin = 0, .end = 0, .write = false};
    const char* const last = line.end();
    const auto begin = std::from_chars(line.begin(), last, part.begin, kHexadecimal);
    if (begin.ptr == last || *begin.ptr != '-') continue;
    const auto end = std::from_chars(begin.ptr + 1, last, part.end, kHexadecimal);
    const std::string_view rights(end.ptr, static_cast<std::size_t>(last - end.ptr));
    if (!rights.starts_with(" r")) continue;
    part.write = rights.starts_with(" rw");
    map.parts_.push_back(part);
  }
  return map;
}

bool MemoryMap::allows(std::uintptr_t begin, std::uint64_t bytes, bool to_write) const noexcept {
  const std::uintptr_t end = begin + bytes;
  if (end <= begin) return false;
  auto part = std::ranges::upper_bound(parts_, begin, {}, &Part::end);
  for (; begin < end; ++part) {
    if (part == parts_.end() || part->begin > begin || (to_write && !part->write)) return false;
    begin = part->end;
  }
  return true;
}

}  // namespace plchost
