#include "manager/control/config_reload.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "manager/system/service_manager.hpp"
#include "shm/log/log.hpp"

namespace plchost {

namespace {

constexpr std::size_t kOutputRoom = 1 << 20;  // read at its end only

std::vector<std::string> split_lines(std::string_view text) {
  std::vector<std::string> lines;
  while (!text.empty()) {
    const auto end = std::min(text.find('\n'), text.size());
    if (end > 0) lines.emplace_back(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return lines;
}

}  // namespace

std::string join_lines(const std::vector<std::string>& lines, std::string_view where, std::size_t most) {
  std::string text;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const std::size_t left = lines.size() - i - 1;
    const std::string rest = left == 0 ? "" : fmt::format("\nand {} more: see {}", left, where);
    const std::string_view separator = i == 0 ? "" : "\n";
    const bool fits = text.size() + separator.size() + lines[i].size() + rest.size() <= most;
    if (!fits && i > 0) return fmt::format("{}\nand {} more: see {}", text, left + 1, where);
    if (!fits) return lines[i].substr(0, most - rest.size()) + rest;
    text.append(separator).append(lines[i]);
  }
  return text;
}

ConfigReload::ConfigReload(Reactor& reactor, Settings settings, ControlHandler& next, Apply apply)
    : settings_(std::move(settings)), next_(next), apply_(std::move(apply)), check_(reactor) {}

void ConfigReload::handle(const ControlRequest& request, ControlReplyFunction reply) {
  if (request.verb != ControlVerb::reload_host || !request.instance.empty()) {
    return next_.handle(request, std::move(reply));
  }
  add({.request = request, .reply = std::move(reply)});
}

void ConfigReload::reload_by_signal() {
  add({.request = {.number = 0, .verb = ControlVerb::reload_host, .instance = {}, .argument = {}},
       .reply = nullptr});
}

void ConfigReload::add(Waiting waiting) {
  if (ending_) {
    if (waiting.reply) {
      waiting.reply({.number = waiting.request.number,
                     .code = ErrorCode::unavailable,
                     .text = "the manager is shutting down"});
    }
    return;
  }
  if (!waiting.reply) notify_reloading();
  later_.push_back(std::move(waiting));
  if (round_.empty()) begin();
}

void ConfigReload::begin() {
  round_ = std::exchange(later_, {});
  spdlog::info("reading {} again", settings_.file);
  if (const auto started = start_check(); !started) finish(std::unexpected(started.error()));
}

Result<void> ConfigReload::start_check() {
  return check_.start({settings_.program, "--check-config", settings_.file, "--programs", settings_.programs},
                      kReloadLimit, kOutputRoom, [this](const HelperEnd& end) { check_ended(end); });
}

void ConfigReload::check_ended(const HelperEnd& end) {
  const auto& [status, in_time, output] = end;
  if (!in_time) {
    return finish(
        failure(ErrorCode::timed_out,
                fmt::format("the check of {} took longer than {} s", settings_.file,
                            std::chrono::duration_cast<std::chrono::seconds>(kReloadLimit).count())));
  }
  constexpr int kFaulty = 1;
  if (status.exited_with(kFaulty) && !output.empty()) {
    const std::string text = join_lines(split_lines(output), "plchostd --check-config");
    return finish(failure(ErrorCode::invalid_argument, text));
  }
  if (!status.success()) {
    return finish(failure(ErrorCode::system,
                          fmt::format("the check of {} ended: {}", settings_.file, status.describe())));
  }
  finish(take_over());
}

// Nothing is begun for a client that does not wait any more.
Result<std::string> ConfigReload::take_over() {
  Result<void> in_time = {};
  for (const Waiting& waiting : round_) {
    in_time = waiting.reply ? check_in_time(waiting.request.limit_ns) : Result<void>();
    if (in_time) break;
  }
  PLCHOST_TRY(in_time);
  PLCHOST_TRY_ASSIGN(const auto lines, apply_());
  for (const std::string& line : lines) spdlog::info("reload: {}", line);
  return lines.empty() ? "nothing has changed" : join_lines(lines, "the log of plchostd");
}

void ConfigReload::finish(const Result<std::string>& result) {
  const std::string text = result ? *result : result.error().describe();
  if (!result) {
    for (const std::string& line : split_lines(text)) spdlog::error("reload: {}", line);
  }
  bool signalled = false;
  for (const Waiting& waiting : std::exchange(round_, {})) {
    signalled = signalled || !waiting.reply;
    if (!waiting.reply) continue;
    waiting.reply({.number = waiting.request.number,
                   .code = result ? ErrorCode::ok : result.error().code,
                   .text = text});
  }
  if (!later_.empty()) return begin();
  if (signalled) {
    notify_service_manager(
        fmt::format("READY=1\nSTATUS={}", result ? "the configuration is the file's"
                                                 : "the changed configuration is refused: see "
                                                   "the log"));
  }
}

void ConfigReload::shut_down() {
  ending_ = true;
  check_.give_up();
  for (auto* const list : {&round_, &later_}) {
    for (const Waiting& waiting : std::exchange(*list, {})) {
      if (!waiting.reply) continue;
      waiting.reply({.number = waiting.request.number,
                     .code = ErrorCode::unavailable,
                     .text = "the manager is shutting down; nothing is reloaded"});
    }
  }
}

}  // namespace plchost
