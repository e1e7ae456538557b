#include "api/server/status/exception_watch.hpp"

#include <algorithm>
#include <string>
#include <string_view>
#include <utility>

#include <code_words.hpp>
#include <fmt/format.h>

#include "api/dds/field_info.hpp"
#include "api/dds/text.hpp"
#include "shm/base/names.hpp"
#include "shm/log/log.hpp"

namespace plchost {

namespace {

// As many whole lines as there is room for. If some are left out, the end says so.
void show_back_trace(plc_ExceptionStatus& sample, const ExceptionEntry& entry) {
  constexpr std::size_t kMost = sizeof sample.back_trace - 1;
  std::string lines;
  std::size_t count = 0;
  for (const std::string& function : entry.back_trace) {
    if (lines.size() + 1 + function.size() > kMost) break;
    if (count++ > 0) lines += '\n';
    lines += function;
  }
  dds::copy_text(sample.back_trace, lines);
  dds::copy_text(sample.back_trace_end, count == entry.back_trace.size()
                                            ? entry.back_trace_end
                                            : fmt::format("only the innermost {} functions fit", count));
}

// The last whole lines that there is room for.
void show_activity(plc_ExceptionStatus& sample, const ExceptionEntry& entry) {
  constexpr std::size_t kMost = sizeof sample.activity - 1;
  std::size_t size = 0;
  auto first = entry.activity.rbegin();
  for (; first != entry.activity.rend() && size + first->size() <= kMost; ++first) size += first->size() + 1;
  dds::copy_text(sample.activity, fmt::format("{}", fmt::join(first.base(), entry.activity.end(), "\n")));
}

// Of "GCC 12, build ID 4f", as the file has it: the contract has both apart.
std::pair<std::string_view, std::string_view> parts_of_build(std::string_view build) {
  constexpr std::string_view kBuildId = "build ID ";
  constexpr std::string_view kBetween = ", ";
  const std::size_t at = build.rfind(kBuildId);
  if (at == std::string_view::npos) return {build, {}};
  std::string_view compiler = build.substr(0, at);
  if (compiler.ends_with(kBetween)) compiler.remove_suffix(kBetween.size());
  return {compiler, build.substr(at + kBuildId.size())};
}

void show_circumstances(plc_ExceptionStatus& sample, const ExceptionCircumstances& then) {
  const auto [build, build_id] = parts_of_build(then.build);
  dds::copy_text(sample.version, then.version);
  dds::copy_text(sample.build, cut(build, sizeof sample.build - 1));
  dds::copy_text(sample.build_id, cut(build_id, sizeof sample.build_id - 1));
  dds::copy_text(sample.scheduler, then.scheduler);
  dds::copy_text(sample.settings, cut(then.settings, sizeof sample.settings - 1));
  sample.cycles = then.cycles;
  sample.uptime_ns = then.uptime_ns;
}

}  // namespace

bool ExceptionWatch::follow(const InstanceStatus& instance, const TaskWatch& tasks, TimePoint now) {
  const std::string name(instance.name.view());
  Watched& watched = instances_[name];
  watched.followed = true;
  const bool changed = watched.pid != instance.pid || watched.state != instance.state;
  if (changed || now >= watched.next_look) {
    watched.pid = instance.pid;
    watched.state = instance.state;
    watched.next_look = now + kPeriod;
    look(watched, name);
    watched.sample.present = watched.sample.count > 0 && watched.pid != 0 &&
                             tasks.in_exception(name, dds::text_of(watched.sample.task));
  }
  return table_->update(name, watched.sample);
}

bool ExceptionWatch::end_round() {
  const bool changed = table_->dispose_rest();
  std::erase_if(instances_, [](const auto& entry) { return !entry.second.followed; });
  for (auto& [name, watched] : instances_) watched.followed = false;
  table_->write();
  return changed;
}

void ExceptionWatch::look(Watched& watched, const std::string& name) {
  const std::string path = exception_path(run_directory_, name);
  // Before it is read: a file that is replaced meanwhile is another version at the next look.
  const FileVersion version = FileVersion::of(path);
  const bool is_new = dds::text_of(watched.sample.instance).empty();
  if (!is_new && version == watched.version) return;
  watched.version = version;
  if (is_new) {
    watched.sample = table_->blank();
    dds::copy_text(watched.sample.instance, name);
  }
  const auto history = read_exceptions(path);
  if (history) {
    show(watched, *history);
  } else {
    spdlog::warn("the exceptions of instance '{}' cannot be read, what was known is shown: {}", name,
                 history.error().describe());
  }
}

void ExceptionWatch::show(Watched& watched, const ExceptionHistory& history) {
  plc_ExceptionStatus& sample = watched.sample;
  const ExceptionEntry last = history.entries.empty() ? ExceptionEntry{} : history.entries.back();
  sample.count = std::max<std::uint64_t>(history.count, history.entries.size());
  sample.whole_application = !history.entries.empty() && last.whole_application;
  sample.time_unix_ns = last.unix_ns;
  dds::copy_text(sample.task, last.task);
  sample.kind = dds::code_for(dds::words::ExceptionStatus::kind, last.kind);
  dds::copy_text(sample.signal, last.signal);
  sample.address = last.address;
  dds::copy_text(sample.symbol, last.symbol);
  sample.memory_address = last.memory_address;
  dds::copy_text(sample.text, last.text);
  dds::copy_text(sample.application, last.application);
  show_back_trace(sample, last);
  show_activity(sample, last);
  show_circumstances(sample, last.circumstances);
}

}  // namespace plchost
