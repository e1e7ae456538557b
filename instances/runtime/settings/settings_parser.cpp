#include "instances/runtime/settings/settings_parser.hpp"

#include <algorithm>
#include <charconv>
#include <utility>

#include <fmt/format.h>

#include "instances/runtime/settings/settings_key.hpp"
#include "shm/base/names.hpp"
#include "shm/base/trimmed.hpp"

namespace plchost {

namespace {

constexpr std::string_view kBlank = " \t\v\f";

std::string_view trim(std::string_view text) {
  return trimmed(text, kBlank);
}

bool is_comment(std::string_view text) {
  return text.starts_with(';') || text.starts_with('#');
}

// A comment begins with a ';' or '#' at the start or after a blank, or with a ';' before one. Elsewhere both
// are part of the value.
std::string_view without_comment(std::string_view value) {
  const auto is_blank = [&](std::size_t at) { return at >= value.size() || kBlank.contains(value[at]); };
  for (std::size_t at = value.find_first_of(";#"); at != std::string_view::npos;
       at = value.find_first_of(";#", at + 1)) {
    if (at == 0 || is_blank(at - 1) || (value[at] == ';' && is_blank(at + 1))) return value.substr(0, at);
  }
  return value;
}

// The text behind the '=', without a comment, and without quotes around it.
std::string_view value_of(std::string_view text) {
  text = trim(text);
  const std::size_t end = text.starts_with('"') ? text.find('"', 1) : std::string_view::npos;
  if (end != std::string_view::npos) {
    const std::string_view behind = trim(text.substr(end + 1));
    if (behind.empty() || is_comment(behind)) return text.substr(1, end - 1);
  }
  return trim(without_comment(text));
}

constexpr std::string_view kReferring = "CmpSettings";

}  // namespace

Result<std::vector<FileReference>> SettingsParser::read(std::string_view text, const std::string& file,
                                                        const std::string& folder) {
  constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";
  rest_ = text.substr(text.starts_with(kByteOrderMark) ? kByteOrderMark.size() : 0);
  file_ = file;
  folder_ = folder;
  line_ = 0;
  section_ = {};
  owned_ = false;
  task_.reset();
  references_.clear();
  while (!rest_.empty() && !error_) {
    ++line_;
    read_line(next_line());
  }
  if (error_) return std::unexpected(*error_);
  std::vector<FileReference> references;
  for (auto& [number, reference] : references_) references.push_back(std::move(reference));
  return references;
}

Result<InstanceSettings> SettingsParser::finish() && {
  if (!error_) check_sys_time();
  if (!error_) take_areas();
  if (error_) return std::unexpected(*std::move(error_));
  take_components();
  return std::move(settings_);
}

std::string SettingsParser::place() const {
  return fmt::format("{}:{}", file_, line_);
}

void SettingsParser::fail(std::string_view what) {
  error_ = Error{ErrorCode::invalid_argument, 0, fmt::format("{}: {}", place(), what)};
}

void SettingsParser::remark(std::string_view where, std::string_view what) {
  settings_.remarks.push_back(fmt::format("{}: {}", where, what));
}

// It ends with LF, CR LF, or CR alone.
std::string_view SettingsParser::next_line() {
  const std::size_t end = std::min(rest_.find_first_of("\r\n"), rest_.size());
  const std::string_view line = rest_.substr(0, end);
  rest_.remove_prefix(end);
  rest_.remove_prefix(rest_.starts_with("\r\n") ? 2 : std::min<std::size_t>(rest_.size(), 1));
  return line;
}

void SettingsParser::read_line(std::string_view line) {
  if (line.contains('\0')) return fail("holds a zero byte: not a text file");
  line = trim(line);
  if (line.empty() || is_comment(line)) return;
  if (line.front() == '[') return begin_section(line);
  // Other programs' sections are theirs alone.
  if (in_foreign_section()) {
    if (section_ == kReferring) read_reference(line);
    return;
  }
  const std::size_t equals = line.find('=');
  if (equals == std::string_view::npos) return fail("neither [Section] nor Key=Value nor a comment (; or #)");
  const std::string_view key = trim(line.substr(0, equals));
  if (section_.empty()) return fail(fmt::format("'{}' stands before the first [Section]", shown(key)));
  set(key, value_of(line.substr(equals + 1)));
}

void SettingsParser::begin_section(std::string_view line) {
  const std::size_t end = line.find(']');
  const bool closed = end != std::string_view::npos;
  const std::string_view name = trim(closed ? line.substr(1, end - 1) : line.substr(1));
  const std::string_view behind = closed ? trim(line.substr(end + 1)) : std::string_view();
  const bool owned = is_owned(name);
  const std::string_view meant = owned ? std::string_view() : meant_section(name);
  const bool whole = closed && !name.empty() && (behind.empty() || is_comment(behind));
  if (!whole && in_foreign_section() && !owned && meant.empty()) {
    return remark(place(),
                  fmt::format("'{}' is no section: taken for a line of [{}], whatever it means there",
                              shown(line), shown(section_)));
  }
  if (!closed || name.empty()) return fail("neither [Section] nor Key=Value nor a comment");
  if (!meant.empty()) {
    return fail(fmt::format("there is no section [{}], did you mean [{}]?", shown(name), meant));
  }
  if (!whole) {
    return fail(
        fmt::format("'{}' stands behind [{}]: it belongs on a line of its own", shown(behind), shown(name)));
  }
  enter(name, owned);
}

void SettingsParser::enter(std::string_view name, bool owned) {
  section_ = name;
  owned_ = owned;
  task_.reset();
  if (!owned_ && foreign_.emplace(section_).second) settings_.foreign_sections.emplace_back(section_);
  if (table_section(section_) == kTaskSections) begin_task(section_.substr(kTaskPrefix.size()));
}

void SettingsParser::begin_task(std::string_view name) {
  if (auto valid = check_name("task", name, kMaxTaskName); !valid) {
    return fail(fmt::format("[{}]: {}", shown(section_), valid.error().message));
  }
  const auto [known, is_new] = tasks_.emplace(name, settings_.tasks.size());
  task_ = known->second;
  if (!is_new) return;
  settings_.tasks.push_back({.task = std::string(name), .where = fmt::format("{}: [{}]", place(), section_)});
}

void SettingsParser::set(std::string_view name, std::string_view value) {
  const auto key = find_setting(section_, name);
  if (!key) return fail(key.error().message);
  const std::string identity = setting_identity(**key, name);
  const auto [seen, is_new] = seen_.emplace(fmt::format("[{}] {}", section_, identity), place());
  if (!is_new) {
    remark(place(),
           fmt::format("[{}] {} takes the place of the one in {}", section_, shown(name), seen->second));
    seen->second = place();
  }
  if (std::holds_alternative<UnusedSetting>((*key)->value)) {
    return remark(place(), fmt::format("[{}] {} has no meaning here and is ignored", section_, shown(name)));
  }
  const std::string where = place();
  const SettingsTarget target{.settings = settings_,
                              .components = components_,
                              .areas = areas_,
                              .where = where,
                              .task = task_ ? &settings_.tasks[*task_] : nullptr,
                              .folder = folder_};
  const auto applied = apply_setting(**key, name, value, target);
  if (!applied) {
    fail(fmt::format("[{}] {}: {}", section_, shown(name), applied.error().message));
  } else if (!applied->empty()) {
    remark(place(), fmt::format("[{}] {}: {}", section_, shown(name), *applied));
  }
}

// FileReference.N=FILE[, NAME]
void SettingsParser::read_reference(std::string_view line) {
  constexpr std::string_view kKey = "FileReference.";
  const std::size_t equals = line.find('=');
  const std::string_view key = trim(line.substr(0, equals));
  if (equals == std::string_view::npos || !key.starts_with(kKey)) return;
  const std::string_view digits = key.substr(kKey.size());
  unsigned number = 0;
  const char* const end = digits.data() + digits.size();
  // NOLINTNEXTLINE(bugprone-suspicious-stringview-data-usage): `end` is the size
  const auto [stop, error] = std::from_chars(digits.data(), end, number);
  const std::string_view value = value_of(line.substr(equals + 1));
  const std::string_view path = value_of(value.substr(0, value.find(',')));
  if (error != std::errc() || stop != end || path.empty()) {
    return remark(place(), fmt::format("[{}] '{}' names no file", section_, shown(line)));
  }
  references_.insert_or_assign(number, FileReference{.path = std::string(path), .where = place()});
}

void SettingsParser::take_components() {
  auto& foreign = settings_.foreign_components;
  for (auto& [number, component] : components_) {
    if (!is_foreign_component(component)) {
      settings_.components.push_back(std::move(component));
    } else if (std::ranges::find(foreign, component) == foreign.end()) {
      foreign.push_back(std::move(component));
    }
  }
}

void SettingsParser::take_areas() {
  auto areas = check_areas(areas_);
  if (!areas) {
    error_ = std::move(areas).error();
  } else {
    settings_.areas = *std::move(areas);
  }
}

// us and ns are to have one base, so one of them alone is not enough.
void SettingsParser::check_sys_time() {
  const SysTimeSettings& time = settings_.sys_time;
  if (time == SysTimeSettings{} || (!time.get_us.empty() && !time.get_ns.empty())) return;
  error_ = Error{
      ErrorCode::invalid_argument, 0,
      file_ + ": [SysTime] needs both of CustomSysTimeGetUs and CustomSysTimeGetNs, or none of its keys"};
}

}  // namespace plchost
