#include "manager/config/load_config.hpp"

#include <algorithm>
#include <array>
#include <filesystem>
#include <utility>

#include <fmt/format.h>

#include "manager/config/accounts.hpp"
#include "manager/config/check_relations.hpp"
#include "manager/config/config_table.hpp"
#include "shm/base/names.hpp"
#include "shm/pages/host_page.hpp"
#include "shm/toml/section_reader.hpp"
#include "shm/toml/text_file.hpp"
#include "shm/toml/toml_document.hpp"

namespace plchost {

namespace {

using namespace std::string_view_literals;

struct Loader {
  const ConfigSurroundings& surroundings;
  std::string folder;
  ManagerConfig config;
  std::vector<ConfigProblem> problems;
  ConfigLines lines;

  void read(const TomlTable& root);
  void read_host(const TomlTable& table, unsigned line);
  void read_dds(const TomlTable& table, unsigned line);
  void read_blocks(const TomlTable& table, unsigned line);
  void read_instances(const TomlValue& value);
  void read_instance(const TomlTable& table, unsigned line);
  void complete_cores();
  void check_user(SectionReader& reader);
  void check_identity(SectionReader& reader);
  void check_instance(SectionReader& reader, const InstanceConfig& instance);
  void check_start(SectionReader& reader, const InstanceConfig& instance);
  [[nodiscard]] ConfigReading reading() const {
    return {.surroundings = surroundings, .folder = folder, .config = config};
  }
  const TomlTable* section(const TomlTable& root, std::string_view name);
};

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
  config.host.name = surroundings.host_name;
  read_keys(host_keys(), reading(), reader, config.host);
  if (surroundings.check_state && !reader.wrong("state_directory") && !reader.wrong("name")) {
    if (const auto good = surroundings.check_state(config.host); !good)
      reader.problem("state_directory", good.error().message);
  }
  complete_cores();
}

std::vector<int> without(std::vector<int> cores, const std::vector<int>& taken) {
  std::erase_if(cores, [&](int core) { return std::ranges::find(taken, core) != taken.end(); });
  return cores;
}

// The cores that the file leaves open.
void Loader::complete_cores() {
  const auto& online = surroundings.online_cores;
  HostConfig& host = config.host;
  if (host.cores.empty()) {
    host.cores = surroundings.isolated_cores.empty() ? online : surroundings.isolated_cores;
  }
  if (host.housekeeping_cores.empty()) host.housekeeping_cores = without(online, host.cores);
  if (host.housekeeping_cores.empty()) host.housekeeping_cores = online;
}

void Loader::read_dds(const TomlTable& table, unsigned line) {
  SectionReader reader(table, line, "[dds]", problems);
  read_keys(dds_keys(), reading(), reader, config.dds);
  check_identity(reader);
  check_user(reader);
}

// After [host], which it needs. The audit log and the manager are closed to instances, not to the server.
void Loader::check_user(SectionReader& reader) {
  const std::string& instances = config.host.instance_user;
  if (config.dds.user.empty() || instances.empty() || reader.wrong("user")) return;
  const auto server = user_number(config.dds.user);
  const auto theirs = user_number(instances);
  if (server && theirs && *server == *theirs) {
    reader.problem("user", "is the user of instances, too; give [host] instance_user another one");
  }
}

void Loader::check_identity(SectionReader& reader) {
  DdsConfig& dds = config.dds;
  if (reader.wrong("identity")) return;  // it was meant to have one
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
  read_keys(blocks_keys(), reading(), reader, config.blocks);
  if (config.blocks.host_number != 0 && !config.dds.enabled) {
    reader.problem("host_number", "needs [dds] enabled = true: blocks go to other hosts over DDS");
  }
  // Instances and firmware would have to trust the queues of that user.
  if (config.blocks.host_number != 0 && !config.dds.user.empty()) {
    reader.problem("host_number", "needs an API server with the manager's user: leave [dds] user out");
  }
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
  read_keys(instance_keys(), reading(), reader, instance);
  check_instance(reader, instance);
  lines.push_back({reader.line_of("name"), reader.line_of("core"), reader.line_of("after")});
  config.instances.push_back(std::move(instance));
}

void Loader::check_instance(SectionReader& reader, const InstanceConfig& instance) {
  if (!reader.wrong("settings") && !reader.wrong("application")) check_start(reader, instance);
  if (instance.restart_delay_max < instance.restart_delay) {
    const auto in_ms = [](Duration delay) {
      return std::chrono::duration_cast<std::chrono::milliseconds>(delay).count();
    };
    reader.problem("restart_delay_max_ms",
                   fmt::format("{} is below restart_delay_ms, which is {}; allowed is that or more",
                               in_ms(instance.restart_delay_max), in_ms(instance.restart_delay)));
  }
  if (instance.name == "manager") {
    reader.problem("name", "'manager' is taken by the manager's own control socket");
  }
  if (instance.name == "gateway" && config.blocks.host_number != 0) {
    reader.problem("name", "'gateway' is taken by the node that blocks for other hosts go through");
  }
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
  const auto text = read_config_text(file, kMaxConfigBytes);
  if (!text) return std::unexpected(ConfigErrors{fmt::format("{}: {}", file, text.error().describe())});
  return parse_config(*text, file, surroundings);
}

}  // namespace plchost
