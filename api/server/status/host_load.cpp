#include "api/server/status/host_load.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <sstream>
#include <string>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <unistd.h>

namespace plchost {

namespace {

std::string text_of_file(const char* path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return std::move(text).str();
}

}  // namespace

std::int32_t load_percent(std::string_view text) {
  const std::string_view first = text.substr(0, text.find(' '));
  double load = 0;
  const auto read =
      std::from_chars(first.data(), first.data() + first.size(), load, std::chars_format::fixed);
  constexpr double kMost = 1e6;
  constexpr double kPercent = 100;
  const bool whole = read.ec == std::errc() && read.ptr == first.data() + first.size();
  return whole && load >= 0 && load <= kMost ? static_cast<std::int32_t>(std::lround(load * kPercent)) : -1;
}

std::uint64_t memory_mib(std::string_view text, std::string_view name) {
  const std::size_t line = text.find(fmt::format("{}:", name));
  if (line == std::string_view::npos) return 0;
  std::string_view rest = text.substr(line + name.size() + 1);
  rest.remove_prefix(std::min(rest.find_first_not_of(' '), rest.size()));
  std::uint64_t kib = 0;
  const auto read = std::from_chars(rest.data(), rest.data() + rest.size(), kib);
  constexpr std::uint64_t kKibInMib = 1024;
  return read.ec == std::errc() ? kib / kKibInMib : 0;
}

void HostLoad::look(TimePoint now) {
  if (now < next_) return;
  next_ = now + kPeriod;
  load_percent_ = load_percent(text_of_file("/proc/loadavg"));
  cores_ = static_cast<std::uint32_t>(std::max(::sysconf(_SC_NPROCESSORS_ONLN), 0L));
  const std::string memory = text_of_file("/proc/meminfo");
  memory_mib_ = memory_mib(memory, "MemTotal");
  available_mib_ = memory_mib(memory, "MemAvailable");
}

void HostLoad::put(plc_HostStatus& sample) const noexcept {
  sample.load_percent = load_percent_;
  sample.cores = cores_;
  sample.memory_mib = memory_mib_;
  sample.available_mib = available_mib_;
}

}  // namespace plchost
