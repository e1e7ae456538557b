#include "instances/launch/launch_contract.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace plchost {

namespace {

using Json = nlohmann::json;

constexpr std::array kSteps = {
    std::pair{SetupStep::bind_core, std::string_view("bind core")},
    std::pair{SetupStep::lock_memory, std::string_view("lock memory")},
    std::pair{SetupStep::read_settings, std::string_view("read settings")},
    std::pair{SetupStep::attach_pool, std::string_view("attach pool")},
    std::pair{SetupStep::open_control_socket, std::string_view("open control socket")},
    std::pair{SetupStep::load_components, std::string_view("load components")},
    std::pair{SetupStep::load_application, std::string_view("load application")},
    std::pair{SetupStep::make_tasks, std::string_view("make tasks")},
    std::pair{SetupStep::make_status_page, std::string_view("make status page")},
    std::pair{SetupStep::start_scheduler, std::string_view("start scheduler")},
    std::pair{SetupStep::ready, std::string_view("ready")},
};

constexpr std::array kStartKinds = {
    std::pair{StartKind::first, std::string_view("first")},
    std::pair{StartKind::warm, std::string_view("warm")},
    std::pair{StartKind::cold, std::string_view("cold")},
    std::pair{StartKind::after_fault, std::string_view("after-fault")},
};

constexpr unsigned kLastCode = static_cast<unsigned>(ErrorCode::wrong_size);

// The value of `key` if it is a text; a report of any other form is corrupt.
Result<std::string> text_of(const Json& json, const char* key) {
  const auto found = json.find(key);
  if (found == json.end() || !found->is_string()) {
    return failure(ErrorCode::corrupt, fmt::format("set-up report has no text '{}'", key));
  }
  return found->get<std::string>();
}

}  // namespace

std::string_view to_string(SetupStep step) noexcept {
  for (const auto& [known, name] : kSteps) {
    if (known == step) return name;
  }
  return "unknown";
}

std::string_view to_string(StartKind kind) noexcept {
  for (const auto& [known, name] : kStartKinds) {
    if (known == kind) return name;
  }
  return "unknown";
}

Result<StartKind> start_kind_of(std::string_view name) {
  for (const auto& [kind, known] : kStartKinds) {
    if (known == name) return kind;
  }
  return failure(ErrorCode::invalid_argument,
                 fmt::format("'{}' is no start kind: first, warm, cold and after-fault are", name));
}

std::vector<std::string> to_arguments(const std::string& program, const LaunchOptions& options) {
  std::vector<std::string> arguments{program, "--name", options.name};
  const auto add = [&](const char* option, std::string value) {
    arguments.emplace_back(option);
    arguments.push_back(std::move(value));
  };
  if (!options.cores.empty()) add("--core", fmt::format("{}", fmt::join(options.cores, ",")));
  if (!options.scheduler.empty()) add("--scheduler", options.scheduler);
  add("--priority-band", options.priority_band);
  if (!options.settings.empty()) add("--settings", options.settings);
  if (options.kept_settings) arguments.emplace_back("--kept-settings");
  if (!options.application.empty()) add("--application", options.application);
  add("--pool", options.pool);
  if (!options.run_directory.empty()) add("--run-directory", options.run_directory);
  if (!options.state_directory.empty()) add("--state-directory", options.state_directory);
  if (!options.user.empty()) add("--user", options.user);
  if (!options.control_group.empty()) add("--control-group", options.control_group);
  if (options.oom_score) add("--oom-score", std::to_string(*options.oom_score));
  for (const unsigned user : options.trusted_users) add("--trusted-user", std::to_string(user));
  if (options.no_debug) arguments.emplace_back("--no-debug");
  if (options.stopped) arguments.emplace_back("--stopped");
  if (options.start_kind != StartKind::first) add("--start-kind", std::string(to_string(options.start_kind)));
  if (options.report_fd >= 0) add("--report-fd", std::to_string(options.report_fd));
  add("--log-level", options.log_level);
  return arguments;
}

std::string instance_socket_path(std::string_view run_directory, std::string_view instance) {
  return fmt::format("{}/{}.sock", run_directory, instance);
}

std::string instance_claim_path(std::string_view run_directory, std::string_view instance) {
  return fmt::format("{}/{}.claim", run_directory, instance);
}

std::string kept_settings_path(std::string_view run_directory, std::string_view instance) {
  return fmt::format("{}/{}.settings", run_directory, instance);
}

std::string retain_memory_name(std::string_view instance) {
  return fmt::format("{}.retain", instance);
}

std::string encode(const SetupReport& report) {
  const Json json{{"step", to_string(report.step)},
                  {"code", static_cast<unsigned>(report.code)},
                  {"text", report.text},
                  {"transient", report.transient}};
  // Bytes that are not UTF-8 (a hostile file name in an error text) are replaced, never thrown about.
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

Result<SetupReport> decode_report(std::string_view packet) {
  const Json json = Json::parse(packet, nullptr, false);
  if (!json.is_object()) return failure(ErrorCode::corrupt, "set-up report is not a JSON object");
  PLCHOST_TRY_ASSIGN(const auto step, text_of(json, "step"));
  PLCHOST_TRY_ASSIGN(auto text, text_of(json, "text"));
  const auto code = json.find("code");
  if (code == json.end() || !code->is_number_unsigned() || code->get<std::uint64_t>() > kLastCode) {
    return failure(ErrorCode::corrupt, "set-up report has no valid 'code'");
  }
  const auto transient = json.find("transient");
  if (transient == json.end() || !transient->is_boolean()) {
    return failure(ErrorCode::corrupt, "set-up report has no valid 'transient'");
  }
  for (const auto& [known, name] : kSteps) {
    if (name == step) {
      return SetupReport{known, static_cast<ErrorCode>(code->get<unsigned>()), std::move(text),
                         transient->get<bool>()};
    }
  }
  return failure(ErrorCode::corrupt, fmt::format("set-up report has the unknown step '{}'", step));
}

std::string encode(const InstanceReport& report) {
  const Json json{{"pid", report.pid},
                  {"state", report.state},
                  {"problem", report.problem},
                  {"application", report.application},
                  {"scheduler", report.scheduler},
                  {"cores", report.cores},
                  {"memory_locked", report.memory_locked}};
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

Result<InstanceReport> decode_instance_report(std::string_view text) {
  const Json json = Json::parse(text, nullptr, false);
  if (!json.is_object()) return failure(ErrorCode::corrupt, "instance report is not a JSON object");
  const auto has = [&](const char* key, auto test) {
    const auto found = json.find(key);
    return found != json.end() && test(*found);
  };
  const auto is_int = [](const Json& value) {
    return value.is_number_integer() && value.get<std::int64_t>() >= std::numeric_limits<int>::min() &&
           value.get<std::int64_t>() <= std::numeric_limits<int>::max();
  };
  const auto is_text = [](const Json& value) { return value.is_string(); };
  const auto is_bool = [](const Json& value) { return value.is_boolean(); };
  const auto is_state = [](const Json& value) {
    return value.is_number_unsigned() && value.get<std::uint64_t>() <= kLastApplicationState;
  };
  const auto is_ints = [&](const Json& value) {
    return value.is_array() && std::all_of(value.begin(), value.end(), is_int);
  };
  if (!has("pid", is_int) || !has("state", is_state) || !has("problem", is_text) ||
      !has("application", is_text) || !has("scheduler", is_text) || !has("cores", is_ints) ||
      !has("memory_locked", is_bool)) {
    return failure(ErrorCode::corrupt, "instance report lacks a field, or one is of another type");
  }
  return InstanceReport{.pid = json["pid"].get<int>(),
                        .state = json["state"].get<unsigned>(),
                        .problem = json["problem"].get<std::string>(),
                        .application = json["application"].get<std::string>(),
                        .scheduler = json["scheduler"].get<std::string>(),
                        .cores = json["cores"].get<std::vector<int>>(),
                        .memory_locked = json["memory_locked"].get<bool>()};
}

}  // namespace plchost
