#include "manager/config/load_config.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <filesystem>
#include <fstream>
#include <optional>
#include <sstream>
#include <utility>

#include <fmt/format.h>

#include "manager/config/accounts.hpp"
#include "manager/config/check_relations.hpp"
#include "shm/base/names.hpp"
#include "shm/log/log_levels.hpp"
#include "shm/pages/host_page.hpp"
#include "shm/toml/section_reader.hpp"
#include "shm/toml/toml_document.hpp"

namespace plchost {

namespace {

using namespace std::string_view_literals;

constexpr std::array kPriorityBands = {"high"sv, "normal"sv, "low"sv};
constexpr std::int64_t kMaxCoreNumber = 1023;  // CPU_SETSIZE
constexpr std::string_view kAllHosts = "all";  // a word of plcctl --host

struct Loader {
  const ConfigSurroundings& surroundings;
  std::string folder;
  ManagerConfig config;
  std::vector<ConfigProblem> problems;
  ConfigLines lines;

  void read(const TomlTable& root);
  void read_host(const TomlTable& table, unsigned line);
  void read_pool_rights(SectionReader& reader);
  void read_cores(SectionReader& reader);
  void read_dds(const TomlTable& table, unsigned line);
  void read_identity(SectionReader& reader);
  void read_blocks(const TomlTable& table, unsigned line);
  void read_instances(const TomlValue& value);
  void read_instance(const TomlTable& table, unsigned line);
  void read_restart(SectionReader& reader, InstanceConfig& instance);
  void check_directory(SectionReader& reader, std::string_view key, const std::string& path);
  void check_interface(SectionReader& reader);
  bool read_file(SectionReader& reader, std::string_view key, std::string& target);
  void check_start(SectionReader& reader, const InstanceConfig& instance);
  const TomlTable* section(const TomlTable& root, std::string_view name);
};

void check_name_of(SectionReader& reader, std::string_view key, const std::string& name, std::size_t max) {
  if (const auto good = check_name("name", name, max); !good) reader.problem(key, good.error().message);
}

const TomlTable* Loader::section(const TomlTable& root, std::string_view name) {
  const auto found = root.find(name);
  if (found == root.end()) return nullptr;
  const auto* table = std::get_if<TomlTable>(&found->second.value);
  if (table == nullptr) {
    problems.push_back({found->second.line, fmt::format("'{0}' must be a section: [{0}]", name)});
  }
  return table;
}

void Loader::read(const TomlTable& root) {
  constexpr std::array kSections = {"host"sv, "dds"sv, "blocks"sv, "instance"sv};
  for (const auto& [key, value] : root) {
    if (std::ranges::find(kSections, std::string_view(key)) != kSections.end()) continue;
    constexpr std::size_t kShown = 80;
    problems.push_back({value.line, fmt::format("unknown section or key '{}'; allowed are [host], [dds], "
                                                "[blocks], [[instance]]{}",
                                                key.substr(0, kShown), suggestion(key, kSections))});
  }
  const TomlTable none;
  const TomlTable* host = section(root, "host");
  read_host(host != nullptr ? *host : none, host != nullptr ? root.find("host")->second.line : 0);
  if (const TomlTable* dds = section(root, "dds")) read_dds(*dds, root.find("dds")->second.line);
  if (const TomlTable* blocks = section(root, "blocks"))
    read_blocks(*blocks, root.find("blocks")->second.line);
  if (const auto found = root.find("instance"); found != root.end()) read_instances(found->second);
}

void Loader::read_host(const TomlTable& table, unsigned line) {
  SectionReader reader(table, line, "[host]", problems);
  HostConfig& host = config.host;
  host.name = surroundings.host_name;
  std::int64_t domain = host.dds_domain;
  std::int64_t objects = host.pool_objects;
  reader.text("name", host.name);
  reader.number("dds_domain", 0, kMaxDdsDomain, domain);
  reader.text("run_directory", host.run_directory);
  reader.text("state_directory", host.state_directory);
  reader.text("pool", host.pool);
  std::int64_t limit = host.application_limit_mib;
  std::int64_t versions = host.application_versions;
  reader.number("application_limit_mib", 1, kMaxApplicationMib, limit);
  reader.number("application_versions", 1, kMaxApplicationVersions, versions);
  host.application_limit_mib = static_cast<std::uint32_t>(limit);
  host.application_versions = static_cast<std::uint32_t>(versions);
  reader.number("pool_objects", kMinPoolObjects, kMaxPoolObjects, objects);
  reader.choice("log_level", kLogLevels, host.log_level);
  reader.truth("keep_pool", host.keep_pool);
  host.dds_domain = static_cast<int>(domain);
  host.pool_objects = static_cast<std::uint32_t>(objects);
  check_name_of(reader, "name", host.name, kMaxHostName);
  check_name_of(reader, "pool", host.pool, kMaxPoolName);
  if (!host.run_directory.starts_with('/') || host.run_directory.size() > kMaxRunDirectory) {
    reader.problem("run_directory",
                   fmt::format("\"{}\" is not allowed; allowed is an absolute path of up to {} characters",
                               host.run_directory.substr(0, kMaxPath), kMaxRunDirectory));
  }
  if (!host.state_directory.starts_with('/') || host.state_directory.size() > kMaxPath) {
    reader.problem("state_directory",
                   fmt::format("\"{}\" is not allowed; allowed is an absolute path of up to {} characters",
                               host.state_directory.substr(0, kMaxPath), kMaxPath));
  }
  if (host.name == kAllHosts) reader.problem("name", "'all' stands for all hosts; choose another name");
  check_directory(reader, "run_directory", host.run_directory);
  check_directory(reader, "state_directory", host.state_directory);
  reader.texts("labels", kMaxLabels, host.labels);
  for (const std::string& label : host.labels) check_name_of(reader, "labels", label, kMaxLabel);
  read_pool_rights(reader);
  read_cores(reader);
  reader.refuse_unknown_keys();
}

void Loader::check_directory(SectionReader& reader, std::string_view key, const std::string& path) {
  if (!surroundings.check_directories || !path.starts_with('/')) return;
  if (const auto good = check_directory_can_be_made(path); !good)
    reader.problem(key, good.error().describe());
}

void Loader::read_pool_rights(SectionReader& reader) {
  HostConfig& host = config.host;
  std::string mode = fmt::format("{:04o}", host.pool_mode);
  reader.text("pool_owner", host.pool_owner);
  reader.text("pool_group", host.pool_group);
  reader.text("pool_mode", mode);
  if (!host.pool_owner.empty()) {
    if (const auto user = user_number(host.pool_owner); !user)
      reader.problem("pool_owner", user.error().message);
  }
  if (!host.pool_group.empty()) {
    if (const auto group = group_number(host.pool_group); !group) {
      reader.problem("pool_group", group.error().message);
    }
  }
  if (const auto parsed = parse_mode(mode)) {
    host.pool_mode = *parsed;
  } else {
    reader.problem("pool_mode", parsed.error().message);
  }
}

std::vector<int> without(std::vector<int> cores, const std::vector<int>& taken) {
  std::erase_if(cores, [&](int core) { return std::ranges::find(taken, core) != taken.end(); });
  return cores;
}

void Loader::read_cores(SectionReader& reader) {
  const auto& online = surroundings.online_cores;
  std::optional<std::vector<int>> cores;
  std::optional<std::vector<int>> housekeeping;
  reader.numbers("cores", 0, kMaxCoreNumber, cores);
  reader.numbers("housekeeping_cores", 0, kMaxCoreNumber, housekeeping);
  for (const auto& [key, list] :
       {std::pair{"cores"sv, &cores}, std::pair{"housekeeping_cores"sv, &housekeeping}}) {
    if (!*list) continue;
    if ((*list)->empty())
      reader.problem(key, fmt::format("is empty; online are {}", fmt::join(online, ", ")));
    for (const int core : without(**list, online)) {
      reader.problem(key, fmt::format("core {} is not online; online are {}", core, fmt::join(online, ", ")));
    }
  }
  HostConfig& host = config.host;
  host.cores = cores ? *cores : (surroundings.isolated_cores.empty() ? online : surroundings.isolated_cores);
  host.housekeeping_cores = housekeeping ? *housekeeping : without(online, host.cores);
  if (host.housekeeping_cores.empty()) host.housekeeping_cores = online;
}

void Loader::read_dds(const TomlTable& table, unsigned line) {
  SectionReader reader(table, line, "[dds]", problems);
  DdsConfig& dds = config.dds;
  reader.truth("enabled", dds.enabled);
  reader.text("interface", dds.interface);
  reader.texts("peers", kMaxPeers, dds.peers);
  reader.truth("multicast", dds.multicast);
  constexpr std::size_t kMaxInterfaceName = 15;  // IFNAMSIZ
  if (const auto good = check_name("interface", dds.interface, kMaxInterfaceName); !good) {
    reader.problem("interface", good.error().message);
  } else {
    check_interface(reader);
  }
  reader.truth("allow_unsecured", dds.allow_unsecured);
  read_identity(reader);
  for (const std::string& peer : dds.peers) {
    constexpr std::string_view kAddress =
        "0123456789abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ.:-_%[]";
    constexpr std::size_t kMaxAddress = 255;
    if (!peer.empty() && peer.size() <= kMaxAddress && !peer.starts_with('-') &&
        peer.find_first_not_of(kAddress) == std::string::npos) {
      continue;
    }
    reader.problem("peers", fmt::format("\"{}\" is not an address; allowed is an IP address or a host name, "
                                        "with a port after a colon if it must be",
                                        peer.substr(0, kMaxPath)));
  }
  reader.refuse_unknown_keys();
}

void Loader::check_interface(SectionReader& reader) {
  const auto& there = surroundings.interfaces;
  const std::string& name = config.dds.interface;
  if (!config.dds.enabled || there.empty() || std::ranges::find(there, name) != there.end()) return;
  const std::vector<std::string_view> names(there.begin(), there.end());
  reader.problem("interface", fmt::format("there is no interface '{}'; there are {}{}", shown(name),
                                          join_names(names), suggestion(name, names)));
}

void Loader::read_identity(SectionReader& reader) {
  DdsConfig& dds = config.dds;
  const std::size_t before = problems.size();
  reader.text("identity", dds.identity);
  if (problems.size() > before) return;  // it was meant to have one
  if (dds.identity.empty()) {
    if (reader.has("identity")) reader.problem("identity", "is no path; leave the key out for no security");
    if (dds.enabled && !dds.interface.empty() && dds.interface != "lo" && !dds.allow_unsecured) {
      reader.problem("interface",
                     fmt::format("\"{}\" without an identity opens this controller to all who reach it; set "
                                 "identity = \"FOLDER\" ('plcctl security init' makes it), or "
                                 "allow_unsecured = true",
                                 dds.interface));
    }
    return;
  }
  dds.identity = resolve_path(folder, dds.identity);
  std::error_code error;
  if (surroundings.check_files && !std::filesystem::is_directory(dds.identity, error)) {
    reader.problem("identity",
                   fmt::format("'{}' is no folder; 'plcctl security init' makes one", shown(dds.identity)));
  }
}

// After [dds], which it needs.
void Loader::read_blocks(const TomlTable& table, unsigned line) {
  SectionReader reader(table, line, "[blocks]", problems);
  BlocksConfig& blocks = config.blocks;
  std::int64_t number = 0;
  reader.number("host_number", 0, kMaxHostNumber, number);
  blocks.host_number = static_cast<std::uint16_t>(number);
  reader.text("base", blocks.base);
  check_name_of(reader, "base", blocks.base, kMaxBlockBase);
  if (number != 0 && !config.dds.enabled) {
    reader.problem("host_number", "needs [dds] enabled = true: blocks go to other hosts over DDS");
  }
  reader.refuse_unknown_keys();
}

void Loader::read_instances(const TomlValue& value) {
  const auto* array = std::get_if<TomlArray>(&value.value);
  if (array == nullptr) {
    problems.push_back({value.line, "'instance' must be written with double brackets: [[instance]]"});
    return;
  }
  if (array->size() > kMaxInstances) {
    problems.push_back(
        {value.line, fmt::format("{} instances; allowed are up to {}", array->size(), kMaxInstances)});
    return;
  }
  for (const TomlValue& element : *array) {
    if (const auto* table = std::get_if<TomlTable>(&element.value)) {
      read_instance(*table, element.line);
    } else {
      problems.push_back({element.line, "'instance' must be written with double brackets: [[instance]]"});
    }
  }
}

void Loader::read_instance(const TomlTable& table, unsigned line) {
  const auto name = table.find("name");
  const auto* text = name == table.end() ? nullptr : std::get_if<std::string>(&name->second.value);
  const std::string shown = text != nullptr ? *text : fmt::format("number {}", config.instances.size() + 1);
  SectionReader reader(table, line, fmt::format("[[instance]] '{}'", shown.substr(0, kMaxInstanceName)),
                       problems);
  InstanceConfig instance;
  reader.text("name", instance.name);
  std::int64_t core = -1;
  reader.number("core", 0, kMaxCoreNumber, core);
  instance.core = static_cast<int>(core);
  reader.truth("share_core", instance.share_core);
  reader.choice("scheduler", surroundings.schedulers, instance.scheduler);
  reader.choice("priority_band", kPriorityBands, instance.priority_band);
  const bool settings = read_file(reader, "settings", instance.settings);
  const bool application = read_file(reader, "application", instance.application);
  if (settings && application) check_start(reader, instance);
  reader.truth("autostart", instance.autostart);
  reader.texts("after", kMaxInstances, instance.after);
  read_restart(reader, instance);
  reader.refuse_unknown_keys();
  if (!reader.has("name")) {
    reader.problem("name", "is missing");
  } else if (text != nullptr) {
    check_name_of(reader, "name", instance.name, kMaxInstanceName);
  }
  if (instance.name == "manager") {
    reader.problem("name", "'manager' is taken by the manager's own control socket");
  }
  if (instance.name == "gateway" && config.blocks.host_number != 0) {
    reader.problem("name", "'gateway' is taken by the node that blocks for other hosts go through");
  }
  if (!reader.has("core")) reader.problem("core", "is missing; say which core it runs on");
  lines.push_back({reader.line_of("name"), reader.line_of("core"), reader.line_of("after")});
  config.instances.push_back(std::move(instance));
}

void Loader::read_restart(SectionReader& reader, InstanceConfig& instance) {
  std::string policy = "on-failure";
  reader.choice("restart", kRestartPolicyNames, policy);
  const auto found = std::ranges::find(kRestartPolicyNames, policy);
  instance.restart = static_cast<RestartPolicy>(found - kRestartPolicyNames.begin());
  using std::chrono::milliseconds;
  using std::chrono::seconds;
  auto delay = std::chrono::duration_cast<milliseconds>(instance.restart_delay).count();
  auto delay_max = std::chrono::duration_cast<milliseconds>(instance.restart_delay_max).count();
  auto window = std::chrono::duration_cast<seconds>(instance.crash_window).count();
  std::int64_t limit = instance.crash_limit;
  reader.number("restart_delay_ms", 0, kMaxRestartDelayMs, delay);
  reader.number("restart_delay_max_ms", 0, kMaxRestartDelayMs, delay_max);
  reader.number("crash_limit", 1, kMaxCrashLimit, limit);
  reader.number("crash_window_s", 1, kMaxCrashWindowS, window);
  if (delay_max < delay) {
    reader.problem(
        "restart_delay_max_ms",
        fmt::format("{} is below restart_delay_ms, which is {}; allowed is that or more", delay_max, delay));
  }
  instance.restart_delay = milliseconds(delay);
  instance.restart_delay_max = milliseconds(delay_max);
  instance.crash_limit = static_cast<std::uint32_t>(limit);
  instance.crash_window = seconds(window);
}

// With settings that are wrong no application is tried: it would only say the same.
void Loader::check_start(SectionReader& reader, const InstanceConfig& instance) {
  if (!instance.settings.empty() && surroundings.check_settings) {
    if (const auto good = surroundings.check_settings(instance.settings); !good) {
      reader.problem("settings", good.error().describe());
      return;
    }
  }
  if (instance.application.empty() || !surroundings.check_application) return;
  if (const auto good = surroundings.check_application(config.host, instance); !good)
    reader.problem("application", good.error().describe());
}

// Whether all that is said is right, be it nothing.
bool Loader::read_file(SectionReader& reader, std::string_view key, std::string& target) {
  const std::size_t before = problems.size();
  std::string path;
  reader.text(key, path);
  if (path.empty()) {
    if (reader.has_text(key)) reader.problem(key, "is no path; leave the key out if there is no file");
    return problems.size() == before;
  }
  path = resolve_path(folder, path);
  if (path.size() > kMaxPath) {
    reader.problem(key, fmt::format("path of {} characters; allowed are up to {}", path.size(), kMaxPath));
    return false;
  }
  if (surroundings.check_files) {
    if (const auto good = check_readable_file(path); !good) reader.problem(key, good.error().describe());
  }
  target = path;
  return problems.size() == before;
}

}  // namespace

std::string resolve_path(const std::string& folder, const std::string& path) {
  return (std::filesystem::path(folder) / path).lexically_normal().string();
}

std::expected<ManagerConfig, ConfigErrors> parse_config(std::string_view text, const std::string& file,
                                                        const ConfigSurroundings& surroundings) {
  std::error_code ignored;
  const auto absolute = std::filesystem::absolute(file, ignored);
  Loader loader{.surroundings = surroundings,
                .folder = absolute.parent_path().string(),
                .config = {},
                .problems = {},
                .lines = {}};
  if (auto root = parse_toml(text)) {
    loader.read(*root);
    check_relations(loader.config, loader.lines, surroundings.online_cores, loader.problems);
  } else {
    loader.problems.push_back(std::move(root.error()));
  }
  if (loader.problems.empty()) return std::move(loader.config);
  std::ranges::stable_sort(loader.problems, {}, &ConfigProblem::line);
  ConfigErrors errors;
  for (const ConfigProblem& problem : loader.problems) {
    errors.push_back(describe(file, problem));
  }
  return std::unexpected(std::move(errors));
}

std::expected<ManagerConfig, ConfigErrors> load_config(const std::string& file,
                                                       const ConfigSurroundings& surroundings) {
  if (const auto readable = check_readable_file(file); !readable) {
    return std::unexpected(ConfigErrors{fmt::format("{}: {}", file, readable.error().describe())});
  }
  std::ifstream stream(file, std::ios::binary);
  std::string text(kMaxConfigBytes + 1, '\0');
  stream.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (stream.bad()) {  // half a file is another configuration
    const auto why = failure(ErrorCode::system, "cannot be read", errno);
    return std::unexpected(ConfigErrors{fmt::format("{}: {}", file, why.error().describe())});
  }
  text.resize(static_cast<std::size_t>(stream.gcount()));
  if (text.size() > kMaxConfigBytes) {
    return std::unexpected(
        ConfigErrors{fmt::format("{}: is larger than the {} bytes that are allowed", file, kMaxConfigBytes)});
  }
  return parse_config(text, file, surroundings);
}

}  // namespace plchost
