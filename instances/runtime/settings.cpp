#include "instances/runtime/settings.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include <fmt/format.h>
#include <ini.h>

#include "shm/base/names.hpp"

namespace plchost {

namespace {

constexpr std::string_view kComponentPrefix = "Component.";

Result<std::int64_t> integer(std::string_view value, std::int64_t lowest, std::int64_t highest) {
  std::int64_t number = 0;
  const char* const end = value.data() + value.size();
  // NOLINTNEXTLINE(bugprone-suspicious-stringview-data-usage): `end` is the size
  const auto [stop, error] = std::from_chars(value.data(), end, number);
  if (error != std::errc() || stop != end || number < lowest || number > highest) {
    return failure(ErrorCode::invalid_argument,
                   fmt::format("'{}' is not allowed: an integer from {} to {} is", value, lowest, highest));
  }
  return number;
}

using Apply = Result<void> (*)(SchedulerSettings&, std::string_view value);

struct Key {
  std::string_view section;
  std::string_view name;
  Apply apply;
};

Result<void> set_interval(SchedulerSettings& settings, std::string_view value) {
  const auto us = integer(value, 50, 1'000'000);
  if (!us) return std::unexpected(us.error());
  settings.scheduler_interval = std::chrono::microseconds(*us);
  return {};
}

Result<void> set_freewheeling(SchedulerSettings& settings, std::string_view value) {
  const auto ms = integer(value, 1, 60'000);
  if (!ms) return std::unexpected(ms.error());
  settings.freewheeling_cycletime = std::chrono::milliseconds(*ms);
  return {};
}

Result<void> set_load(SchedulerSettings& settings, std::string_view value) {
  const auto percent = integer(value, 1, 99);
  if (!percent) return std::unexpected(percent.error());
  settings.processor_load_maximum = static_cast<int>(*percent);
  return {};
}

Result<void> set_spin(SchedulerSettings& settings, std::string_view value) {
  const auto us = integer(value, 0, 1000);
  if (!us) return std::unexpected(us.error());
  settings.spin_ahead_max = std::chrono::microseconds(*us);
  return {};
}

Result<void> set_backlog(SchedulerSettings& settings, std::string_view value) {
  const auto events = integer(value, 1, 1'000'000'000);
  if (!events) return std::unexpected(events.error());
  settings.max_event_backlog = static_cast<std::uint64_t>(*events);
  return {};
}

Result<void> set_timer_source(SchedulerSettings& settings, std::string_view value) {
  if (value == "System") {
    settings.tick_source = TickSourceKind::system;
  } else if (value == "Task") {
    settings.tick_source = TickSourceKind::task;
  } else {
    return failure(ErrorCode::invalid_argument,
                   fmt::format("'{}' is not allowed: System and Task are", value));
  }
  return {};
}

constexpr std::array kKeys = {
    Key{"CmpSchedule", "SchedulerInterval", set_interval},
    Key{"CmpSchedule", "Task.Freewheeling.Cycletime", set_freewheeling},
    Key{"CmpSchedule", "ProcessorLoad.Maximum", set_load},
    Key{"CmpSchedule", "SpinAhead.MaxUs", set_spin},
    Key{"CmpSchedule", "ExternalEvent.MaxBacklog", set_backlog},
    Key{"SysTimer", "VxWorks.TimerSource", set_timer_source},
    Key{"ComponentManager", "Component.N", nullptr},
};

bool is_owned(std::string_view section) {
  return std::ranges::any_of(kKeys, [&](const Key& key) { return key.section == section; });
}

// "Linux.X" is the seed's "VxWorks.X".
std::string canonical(std::string_view key) {
  constexpr std::string_view kLinux = "Linux.";
  return key.starts_with(kLinux) ? fmt::format("VxWorks.{}", key.substr(kLinux.size())) : std::string(key);
}

// Feeds inih line by line, so that errors can name the line: Debian's inih does not tell its handler.
class Parser {
 public:
  Parser(std::string_view text, std::string_view file) : rest_(text), file_(file) {}

  Result<InstanceSettings> parse() {
    const int wrong_line = ini_parse_stream(&Parser::read_line, this, &Parser::handle, this);
    if (error_) return std::unexpected(*std::move(error_));
    if (wrong_line > 0) {
      line_ = wrong_line;
      fail("neither [Section] nor Key=Value nor a comment (; or #)");
      return std::unexpected(*std::move(error_));
    }
    if (wrong_line < 0) return failure(ErrorCode::system, fmt::format("{}: no memory to read it", file_));
    for (auto& [number, component] : components_) settings_.components.push_back(std::move(component));
    return std::move(settings_);
  }

 private:
  void fail(std::string_view what) {
    if (error_) return;  // the first one is told
    error_ = Error{ErrorCode::invalid_argument, 0, fmt::format("{}:{}: {}", file_, line_, what)};
  }

  // inih's fgets.
  static char* read_line(char* to, int size, void* stream) {
    auto& self = *static_cast<Parser*>(stream);
    return self.next_line(std::span(to, static_cast<std::size_t>(size))) ? to : nullptr;
  }

  bool next_line(std::span<char> to) {
    if (rest_.empty() || error_) return false;
    ++line_;
    const std::size_t end = rest_.find('\n');
    std::string_view line = rest_.substr(0, end);
    rest_ = end == std::string_view::npos ? std::string_view() : rest_.substr(end + 1);
    if (line.size() > std::min(kMaxSettingsLine, to.size() - 1)) {
      fail(fmt::format("the line is longer than {} bytes", kMaxSettingsLine));
      return false;
    }
    if (line.find('\0') != std::string_view::npos) {
      fail("holds a zero byte: not a text file");
      return false;
    }
    // To inih an indented line continues the value before it; to us it is a line like any other.
    line.remove_prefix(std::min(line.find_first_not_of(" \t"), line.size()));
    *std::ranges::copy(line, to.begin()).out = '\0';
    return true;
  }

  static int handle(void* user, const char* section, const char* key, const char* value) {
    auto& self = *static_cast<Parser*>(user);
    self.set(section, key, value);
    return 1;
  }

  void set(std::string_view section, std::string_view key, std::string_view value) {
    if (section.empty()) return fail(fmt::format("'{}' stands before the first [Section]", key));
    if (!is_owned(section)) {
      if (std::ranges::find(settings_.foreign_sections, section) == settings_.foreign_sections.end()) {
        settings_.foreign_sections.emplace_back(section);
      }
      return;
    }
    const std::string name = canonical(key);
    if (!seen_.insert(fmt::format("[{}] {}", section, name)).second) {
      return fail(fmt::format("[{}] {} is given twice", section, key));
    }
    if (section == "ComponentManager") return add_component(key, value);
    const auto known = std::ranges::find_if(
        kKeys, [&](const Key& candidate) { return candidate.section == section && candidate.name == name; });
    if (known == kKeys.end()) return unknown_key(section, key);
    if (const auto applied = known->apply(settings_.scheduler, value); !applied) {
      fail(fmt::format("[{}] {}: {}", section, key, applied.error().message));
    }
  }

  void add_component(std::string_view key, std::string_view value) {
    const std::string_view number =
        key.starts_with(kComponentPrefix) ? key.substr(kComponentPrefix.size()) : std::string_view();
    const auto index = integer(number, 0, kMaxComponents);
    if (!index) return unknown_key("ComponentManager", key);
    if (value.empty()) return fail(fmt::format("[ComponentManager] {}: names no file", key));
    if (!components_.emplace(*index, value).second) {
      return fail(fmt::format("[ComponentManager] {} is given twice", key));
    }
  }

  void unknown_key(std::string_view section, std::string_view key) {
    std::vector<std::string_view> allowed;
    for (const Key& known : kKeys) {
      if (known.section == section) allowed.push_back(known.name);
    }
    const std::string_view nearest = nearest_name(canonical(key), allowed);
    fail(fmt::format("[{}] has no key '{}'{}; allowed are {}", section, key,
                     nearest.empty() ? "" : fmt::format(", did you mean '{}'?", nearest),
                     section == "ComponentManager"
                         ? fmt::format("Component.N with N from 0 to {}", kMaxComponents)
                         : join_names(allowed)));
  }

  std::string_view rest_;
  std::string_view file_;
  int line_ = 0;
  InstanceSettings settings_;
  std::map<std::int64_t, std::string> components_;
  std::set<std::string> seen_;
  std::optional<Error> error_;
};

}  // namespace

Result<InstanceSettings> parse_settings(std::string_view text, std::string_view file) {
  return Parser(text, file).parse();
}

Result<InstanceSettings> read_settings(const std::string& file) {
  std::error_code error;
  if (!std::filesystem::exists(file, error)) {
    return failure(ErrorCode::not_found, fmt::format("settings file {} does not exist", file));
  }
  if (!std::filesystem::is_regular_file(file, error)) {
    return failure(ErrorCode::invalid_argument, fmt::format("settings file {} is not a file", file));
  }
  std::ifstream stream(file, std::ios::binary);
  std::string text(kMaxSettingsFile + 1, '\0');
  if (!stream) return failure(ErrorCode::refused, fmt::format("open settings file {}", file), errno);
  stream.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(stream.gcount()));
  if (text.size() > kMaxSettingsFile) {
    return failure(ErrorCode::invalid_argument,
                   fmt::format("settings file {} is larger than {} bytes", file, kMaxSettingsFile));
  }
  auto settings = parse_settings(text, file);
  if (!settings) return settings;
  const auto folder = std::filesystem::absolute(file).parent_path();
  for (std::string& component : settings->components) component = (folder / component).lexically_normal();
  return settings;
}

}  // namespace plchost
