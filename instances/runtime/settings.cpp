#include "instances/runtime/settings.hpp"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "instances/runtime/settings_key.hpp"
#include "shm/base/names.hpp"

namespace plchost {

namespace {

constexpr std::string_view kBlank = " \t\v\f";
constexpr std::string_view kTaskPrefix = "Task.";

std::string_view trim(std::string_view text) {
  text.remove_prefix(std::min(text.find_first_not_of(kBlank), text.size()));
  return text.substr(0, text.find_last_not_of(kBlank) + 1);
}

bool is_comment(std::string_view text) {
  return text.starts_with(';') || text.starts_with('#');
}

// A comment begins with a ';' or '#' at the start or after a blank, or with a ';' before one; elsewhere both
// are part of the value.
std::string_view without_comment(std::string_view value) {
  const auto is_blank = [&](std::size_t at) { return at >= value.size() || kBlank.contains(value[at]); };
  for (std::size_t at = value.find_first_of(";#"); at != std::string_view::npos;
       at = value.find_first_of(";#", at + 1)) {
    if (at == 0 || is_blank(at - 1) || (value[at] == ';' && is_blank(at + 1))) return value.substr(0, at);
  }
  return value;
}

// What stands behind the '=', without a comment, and without quotes around it.
std::string_view value_of(std::string_view text) {
  text = trim(text);
  const std::size_t end = text.starts_with('"') ? text.find('"', 1) : std::string_view::npos;
  if (end != std::string_view::npos) {
    const std::string_view behind = trim(text.substr(end + 1));
    if (behind.empty() || is_comment(behind)) return text.substr(1, end - 1);
  }
  return trim(without_comment(text));
}

class Parser {
 public:
  Parser(std::string_view text, std::string_view file) : rest_(text), file_(file) {}

  Result<InstanceSettings> parse() {
    constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";
    if (rest_.starts_with(kByteOrderMark)) rest_.remove_prefix(kByteOrderMark.size());
    while (!rest_.empty() && !error_) {
      ++line_;
      read_line(next_line());
    }
    if (!error_) check_sys_time();
    if (error_) return std::unexpected(*std::move(error_));
    take_components();
    return std::move(settings_);
  }

 private:
  [[nodiscard]] std::string place() const { return fmt::format("{}:{}", file_, line_); }

  void fail(std::string_view what) {
    error_ = Error{ErrorCode::invalid_argument, 0, fmt::format("{}: {}", place(), what)};
  }

  // It ends with LF, CR LF, or CR alone.
  std::string_view next_line() {
    const std::size_t end = std::min(rest_.find_first_of("\r\n"), rest_.size());
    const std::string_view line = rest_.substr(0, end);
    rest_.remove_prefix(end);
    rest_.remove_prefix(rest_.starts_with("\r\n") ? 2 : std::min<std::size_t>(rest_.size(), 1));
    return line;
  }

  void remark(std::string_view what) { settings_.remarks.push_back(fmt::format("{}: {}", place(), what)); }

  [[nodiscard]] bool in_foreign_section() const { return !section_.empty() && !owned_; }

  void read_line(std::string_view line) {
    if (line.contains('\0')) return fail("holds a zero byte: not a text file");
    line = trim(line);
    if (line.empty() || is_comment(line)) return;
    if (line.front() == '[') return begin_section(line);
    // What other programs write in their sections is theirs alone.
    if (in_foreign_section()) return;
    const std::size_t equals = line.find('=');
    if (equals == std::string_view::npos)
      return fail("neither [Section] nor Key=Value nor a comment (; or #)");
    const std::string_view key = trim(line.substr(0, equals));
    if (section_.empty()) return fail(fmt::format("'{}' stands before the first [Section]", shown(key)));
    set(key, value_of(line.substr(equals + 1)));
  }

  void begin_section(std::string_view line) {
    const std::size_t end = line.find(']');
    const bool closed = end != std::string_view::npos;
    const std::string_view name = trim(closed ? line.substr(1, end - 1) : line.substr(1));
    const std::string_view behind = closed ? trim(line.substr(end + 1)) : std::string_view();
    const bool owned = is_owned(name);
    const std::string_view meant = owned ? std::string_view() : meant_section(name);
    const bool whole = closed && !name.empty() && (behind.empty() || is_comment(behind));
    if (!whole && in_foreign_section() && !owned && meant.empty()) {
      return remark(fmt::format("'{}' is no section: taken for a line of [{}], whatever it means there",
                                shown(line), shown(section_)));
    }
    if (!closed || name.empty()) return fail("neither [Section] nor Key=Value nor a comment");
    if (!meant.empty()) {
      return fail(fmt::format("there is no section [{}], did you mean [{}]?", shown(name), meant));
    }
    if (!whole) {
      return fail(fmt::format("'{}' stands behind [{}]: it belongs on a line of its own", shown(behind),
                              shown(name)));
    }
    enter(name, owned);
  }

  void enter(std::string_view name, bool owned) {
    section_ = name;
    owned_ = owned;
    task_.reset();
    if (!owned_ && foreign_.emplace(section_).second) settings_.foreign_sections.emplace_back(section_);
    if (table_section(section_) == kTaskSections) begin_task(section_.substr(kTaskPrefix.size()));
  }

  void begin_task(std::string_view name) {
    if (auto valid = check_name("task", name, kMaxTaskName); !valid) {
      return fail(fmt::format("[{}]: {}", shown(section_), valid.error().message));
    }
    const auto [known, is_new] = tasks_.emplace(name, settings_.tasks.size());
    task_ = known->second;
    if (!is_new) return;
    settings_.tasks.push_back(
        {.task = std::string(name), .where = fmt::format("{}: [{}]", place(), section_)});
  }

  void set(std::string_view name, std::string_view value) {
    const auto key = find_setting(section_, name);
    if (!key) return fail(key.error().message);
    const std::string identity = setting_identity(**key, name);
    const auto [seen, is_new] = seen_.emplace(fmt::format("[{}] {}", section_, identity), place());
    if (!is_new) {
      remark(fmt::format("[{}] {} takes the place of the one in {}", section_, shown(name), seen->second));
      seen->second = place();
    }
    if (std::holds_alternative<UnusedSetting>((*key)->value)) {
      return remark(fmt::format("[{}] {} has no meaning here and is ignored", section_, shown(name)));
    }
    const SettingsTarget target{settings_, components_, task_ ? &settings_.tasks[*task_] : nullptr};
    const auto applied = apply_setting(**key, name, value, target);
    if (!applied) {
      fail(fmt::format("[{}] {}: {}", section_, shown(name), applied.error().message));
    } else if (!applied->empty()) {
      remark(fmt::format("[{}] {}: {}", section_, shown(name), *applied));
    }
  }

  void take_components() {
    auto& foreign = settings_.foreign_components;
    for (auto& [number, component] : components_) {
      if (!is_foreign_component(component)) {
        settings_.components.push_back(std::move(component));
      } else if (std::ranges::find(foreign, component) == foreign.end()) {
        foreign.push_back(std::move(component));
      }
    }
  }

  // us and ns are to have one base, so one of them alone is not enough.
  void check_sys_time() {
    const SysTimeSettings& time = settings_.sys_time;
    if (time == SysTimeSettings{} || (!time.get_us.empty() && !time.get_ns.empty())) return;
    fail("[SysTime] needs both of CustomSysTimeGetUs and CustomSysTimeGetNs, or none of its keys");
  }

  std::string_view rest_;
  std::string_view file_;
  int line_ = 0;
  std::string_view section_;
  bool owned_ = false;
  std::optional<std::size_t> task_;  // of the section [Task.NAME], in settings_.tasks
  InstanceSettings settings_;
  std::map<std::size_t, std::string> components_;
  std::map<std::string, std::size_t> tasks_;  // their places in settings_.tasks
  std::set<std::string> foreign_;
  std::map<std::string, std::string> seen_;  // each key's last place
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
  const auto resolve = [&](std::string& path) { path = (folder / path).lexically_normal(); };
  std::ranges::for_each(settings->components, resolve);
  if (!settings->sys_time.library.empty()) resolve(settings->sys_time.library);
  return settings;
}

}  // namespace plchost
