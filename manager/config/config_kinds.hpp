#pragma once

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "manager/config/accounts.hpp"
#include "manager/config/check_relations.hpp"
#include "manager/config/config_table.hpp"
#include "shm/base/names.hpp"
#include "shm/toml/key_kinds.hpp"
#include "shm/toml/text_file.hpp"

// The kinds of value that only keys of the manager's configuration have.

namespace plchost {

struct SchedulerKey {
  static void read(const ConfigReading& reading, SectionReader& reader, std::string_view name,
                   std::string& target) {
    reader.choice(name, reading.surroundings.schedulers, target);
  }
  static std::string allowed() { return "[a scheduler](../schedulers/README.md)"; }
  static std::string shown(const std::string&) { return ""; }
};

/// Permission bits.
struct ModeKey {
  static void read(const ConfigReading&, SectionReader& reader, std::string_view name, mode_t& target) {
    std::string mode = shown_plain(target);
    reader.text(name, mode);
    if (reader.wrong(name)) return;
    const auto parsed = parse_mode(mode);
    if (!parsed) return reader.problem(name, parsed.error().message);
    target = *parsed;
  }
  static std::string allowed() { return "`\"0600\"` to `\"0666\"`"; }
  static std::string shown(mode_t value) { return fmt::format("`\"{}\"`", shown_plain(value)); }

 private:
  static std::string shown_plain(mode_t value) { return fmt::format("{:04o}", value); }
};

inline constexpr std::int64_t kMaxConfiguredCore = 1023;  // CPU_SETSIZE

/// A core that the section must name; check_relations() looks whether it may have that.
struct RequiredCoreKey {
  static void read(const ConfigReading& reading, SectionReader& reader, std::string_view name, int& target) {
    NumberKey<0, kMaxConfiguredCore>::read(reading, reader, name, target);
    if (!reader.has(name)) reader.problem(name, "is missing; say which core it runs on");
  }
  static std::string allowed() { return "one of `[host]` `cores`"; }
  static std::string shown(int) { return "required"; }
};

/// Cores of this host. Without the key the list stays empty, and the loader completes it.
struct CoresKey {
  static void read(const ConfigReading& reading, SectionReader& reader, std::string_view name,
                   std::vector<int>& target) {
    const auto& online = reading.surroundings.online_cores;
    std::optional<std::vector<int>> cores;
    reader.numbers(name, 0, kMaxConfiguredCore, cores);
    if (!cores) return;
    if (cores->empty()) {
      reader.problem(name, fmt::format("is empty; online are {}", fmt::join(online, ", ")));
    }
    for (const int core : *cores) {
      if (std::ranges::find(online, core) != online.end()) continue;
      reader.problem(name,
                     fmt::format("core {} is not online; online are {}", core, fmt::join(online, ", ")));
    }
    target = *cores;
  }
  static std::string allowed() { return "cores that are on line"; }
  static std::string shown(const std::vector<int>&) { return ""; }
};

/// A file that is there. The target is an absolute path.
struct FileKey {
  static void read(const ConfigReading& reading, SectionReader& reader, std::string_view name,
                   std::string& target) {
    std::string path;
    reader.text(name, path);
    if (path.empty()) {
      if (reader.has_text(name)) reader.problem(name, "is no path; leave the key out if there is no file");
      return;
    }
    path = resolve_path(reading.folder, path);
    if (path.size() > kMaxPath) {
      return reader.problem(
          name, fmt::format("path of {} characters; allowed are up to {}", path.size(), kMaxPath));
    }
    if (reading.surroundings.check_files) {
      if (const auto good = check_readable_file(path); !good) reader.problem(name, good.error().describe());
    }
    target = path;
  }
  static std::string allowed() { return "a file"; }
  static std::string shown(const std::string&) { return ""; }
};

// Rules of texts.

struct FolderRule {
  static std::string form() { return "a folder"; }
  static std::string wrong(const ConfigReading&, const std::string&) { return ""; }
};

struct HostNameRule : NameRule<kMaxHostName> {
  static std::string wrong(const ConfigReading& reading, const std::string& name) {
    constexpr std::string_view kAllHosts = "all";  // a word of plcctl --host
    if (name == kAllHosts) return "'all' stands for all hosts; choose another name";
    return NameRule::wrong(reading, name);
  }
};

template <std::size_t Most>
struct AbsolutePathRule {
  static std::string form() { return fmt::format("an absolute path of up to {} characters", Most); }
  static std::string wrong(const ConfigReading&, const std::string& path) {
    if (path.starts_with('/') && path.size() <= Most) return "";
    return fmt::format("\"{}\" is not allowed; allowed is {}", path.substr(0, kMaxPath), form());
  }
};

/// Of a key whose default is the empty text: none.
template <class Rule>
struct OptionalRule : Rule {
  static std::string wrong(const ConfigReading& reading, const std::string& text) {
    return text.empty() ? "" : Rule::wrong(reading, text);
  }
};

/// A folder that is there or can be made.
template <std::size_t Most>
struct AbsoluteFolderRule : AbsolutePathRule<Most> {
  static std::string wrong(const ConfigReading& reading, const std::string& path) {
    std::string text = AbsolutePathRule<Most>::wrong(reading, path);
    if (!text.empty() || !reading.surroundings.check_directories) return text;
    const auto good = check_directory_can_be_made(path);
    return good ? "" : good.error().describe();
  }
};

struct UserRule {
  static std::string form() { return "name or number in quotes"; }
  static std::string wrong(const ConfigReading&, const std::string& user) {
    const auto number = user.empty() ? Result<uid_t>(0) : user_number(user);
    return number ? "" : number.error().message;
  }
};

struct OwnUserRule {
  static std::string form() { return "name or number in quotes, not root"; }
  static std::string wrong(const ConfigReading& reading, const std::string& user) {
    std::string text = UserRule::wrong(reading, user);
    if (!text.empty() || user.empty() || user_number(user) != uid_t{0}) return text;
    return "root has all rights; name another user, or leave the key out";
  }
};

struct GroupRule {
  static std::string form() { return "name or number in quotes"; }
  static std::string wrong(const ConfigReading&, const std::string& group) {
    const auto number = group.empty() ? Result<gid_t>(0) : group_number(group);
    return number ? "" : number.error().message;
  }
};

struct InterfaceRule {
  static std::string form() { return "an interface of the host"; }
  static std::string wrong(const ConfigReading& reading, const std::string& name) {
    constexpr std::size_t kMaxInterfaceName = 15;  // IFNAMSIZ
    if (const auto good = check_name("interface", name, kMaxInterfaceName); !good)
      return good.error().message;
    const auto& there = reading.surroundings.interfaces;
    if (!reading.config.dds.enabled || there.empty() || std::ranges::find(there, name) != there.end())
      return "";
    const std::vector<std::string_view> names(there.begin(), there.end());
    return fmt::format("there is no interface '{}'; there are {}{}", shown(name), join_names(names),
                       suggestion(name, names));
  }
};

struct PeerRule {
  static std::string form() { return "IP addresses or host names, with a port after a colon if it must be"; }
  static std::string wrong(const ConfigReading&, const std::string& peer) {
    constexpr std::string_view kAddress =
        "0123456789abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ.:-_%[]";
    constexpr std::size_t kMaxAddress = 255;
    if (!peer.empty() && peer.size() <= kMaxAddress && !peer.starts_with('-') &&
        peer.find_first_not_of(kAddress) == std::string::npos && has_good_port(peer)) {
      return "";
    }
    return fmt::format(
        "\"{}\" is not an address; allowed is an IP address or a host name, with a port (1 to 65535) after a "
        "colon if it must be",
        peer.substr(0, kMaxPath));
  }

 private:
  /// Or none: "fe80::1" has several colons, "[fe80::1]:7410" has a port.
  static bool has_good_port(std::string_view peer) {
    const std::size_t colon = peer.rfind(':');
    if (colon == std::string_view::npos) return true;
    const bool bracketed = colon > 0 && peer[colon - 1] == ']';
    if (!bracketed && peer.find(':') != colon) return true;
    const std::string_view port = peer.substr(colon + 1);
    std::uint16_t number = 0;
    const auto [end, error] = std::from_chars(port.data(), port.data() + port.size(), number);
    return error == std::errc() && end == port.data() + port.size() && number > 0;
  }
};

/// Names of instances: check_relations() looks whether there are such.
struct InstanceRule {
  static std::string form() { return "names of other instances"; }
  static std::string wrong(const ConfigReading&, const std::string&) { return ""; }
};

}  // namespace plchost
