#include "api/server/status/host_load.hpp"

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <fstream>
#include <sstream>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <unistd.h>

#include "api/dds/entries.hpp"
#include "api/dds/topics.hpp"

namespace plchost {

namespace {

std::string text_of_file(const char* path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return std::move(text).str();
}

}  // namespace

std::string load_average(std::string_view text) {
  const std::string_view first = text.substr(0, text.find(' '));
  const auto is_part = [](char c) { return (c >= '0' && c <= '9') || c == '.'; };
  constexpr std::size_t kLongest = 12;
  return first.size() <= kLongest && std::ranges::all_of(first, is_part) ? std::string(first) : "";
}

std::string memory_mib(std::string_view text, std::string_view name) {
  const std::size_t line = text.find(fmt::format("{}:", name));
  if (line == std::string_view::npos) return "";
  std::string_view rest = text.substr(line + name.size() + 1);
  rest.remove_prefix(std::min(rest.find_first_not_of(' '), rest.size()));
  std::uint64_t kib = 0;
  const auto read = std::from_chars(rest.data(), rest.data() + rest.size(), kib);
  constexpr std::uint64_t kKibInMib = 1024;
  return read.ec == std::errc() ? fmt::format("{}", kib / kKibInMib) : "";
}

void HostLoad::look(TimePoint now) {
  if (now < next_) return;
  next_ = now + kPeriod;
  load_ = load_average(text_of_file("/proc/loadavg"));
  cores_ = fmt::format("{}", ::sysconf(_SC_NPROCESSORS_ONLN));
  const std::string memory = text_of_file("/proc/meminfo");
  memory_ = memory_mib(memory, "MemTotal");
  available_ = memory_mib(memory, "MemAvailable");
}

void HostLoad::add_to(std::vector<plc_KeyValue>& entries) const {
  dds::add_entry(entries, dds::kLoadEntry, load_);
  dds::add_entry(entries, dds::kCoresEntry, cores_);
  dds::add_entry(entries, dds::kMemoryEntry, memory_);
  dds::add_entry(entries, dds::kAvailableEntry, available_);
}

}  // namespace plchost
