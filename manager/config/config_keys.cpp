// The keys of the configuration file: one row each. Reading, ranges, errors, what a reload does, and the
// tables of manager/configuration.md come from here.

#include <array>

#include "manager/config/config_kinds.hpp"
#include "manager/config/config_table.hpp"
#include "shm/log/log_levels.hpp"
#include "shm/pages/host_words.hpp"

namespace plchost {

namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using enum TakesEffect;

template <auto Member, class Kind>
constexpr auto host(const ConfigKey& key) {
  return KeyAccess<Member>::template row<Kind, ConfigReading>("[host]", key);
}
template <auto Member, class Kind>
constexpr auto dds(const ConfigKey& key) {
  return KeyAccess<Member>::template row<Kind, ConfigReading>("[dds]", key);
}
template <auto Member, class Kind>
constexpr auto blocks(const ConfigKey& key) {
  return KeyAccess<Member>::template row<Kind, ConfigReading>("[blocks]", key);
}
template <auto Member, class Kind>
constexpr auto instance(const ConfigKey& key) {
  return KeyAccess<Member>::template row<Kind, ConfigReading>("[[instance]]", key);
}

constexpr std::string_view kOfNewObjects = "by the pool and by new objects; the others keep their rights";

constexpr std::array kHostKeys = {
    host<&HostConfig::name, TextKey<HostNameRule>>({.name = "name",
                                                    .when = next_manager,
                                                    .why = "folders of the host have this name",
                                                    .initial = "the system's host name",
                                                    .meaning = "how the controller is addressed"}),
    host<&HostConfig::labels, TextsKey<kMaxLabels, NameRule<kMaxLabel>>>(
        {.name = "labels",
         .when = new_server,
         .meaning = "words by which several controllers are addressed at once (`plcctl --label`)"}),
    host<&HostConfig::dds_domain, NumberKey<0, kMaxDdsDomain>>(
        {.name = "dds_domain", .when = new_server, .meaning = "DDS domain of the host and its clients"}),
    host<&HostConfig::run_directory, TextKey<AbsoluteFolderRule<kMaxRunDirectory>>>(
        {.name = "run_directory",
         .when = next_manager,
         .why = "the sockets of its instances are there",
         .meaning = "control sockets and the lock"}),
    host<&HostConfig::state_directory, TextKey<AbsoluteFolderRule<kMaxPath>>>(
        {.name = "state_directory",
         .when = next_manager,
         .why = "its instances keep their files there",
         .meaning =
             "folder of retain and persistent variables, wanted states of the instances "
             "(`wishes.HOST`, of one manager at a time), audit log (`audit.HOST`) and sent "
             "applications (`applications.HOST`). The manager makes it if it is not there, and refuses one "
             "of another user, or that everybody can write"}),
    host<&HostConfig::application_limit_mib, NumberKey<1, kMaxApplicationMib>>(
        {.name = "application_limit_mib",
         .when = new_server,
         .meaning = "the largest application that is taken over DDS, MiB. Four at a time, together twice as "
                    "much, lie in memory (`/dev/shm`) while they come"}),
    host<&HostConfig::application_versions, NumberKey<1, kMaxApplicationVersions>>(
        {.name = "application_versions",
         .when = at_once,
         .meaning = "so many of those that were sent are kept for each instance, beside the loaded one and "
                    "the boot application"}),
    host<&HostConfig::pool, TextKey<NameRule<kMaxPoolName>>>(
        {.name = "pool",
         .when = next_manager,
         .why = "its instances use that pool",
         .meaning = "name of the object pool in `/dev/shm`"}),
    host<&HostConfig::pool_objects, NumberKey<kMinPoolObjects, kMaxPoolObjects>>(
        {.name = "pool_objects",
         .when = next_manager,
         .why = "its instances have the pool mapped",
         .meaning = "room in the pool"}),
    host<&HostConfig::pool_across_containers, TruthKey>(
        {.name = "pool_across_containers",
         .when = next_manager,
         .why = "its instances have the pool mapped",
         .meaning = "programs of other containers (PID namespaces) may use the pool. Its mutexes then do not "
                    "inherit priority. A pool that is there already stays as it is"}),
    host<&HostConfig::pool_owner, TextKey<UserRule>>({.name = "pool_owner",
                                                      .when = at_once,
                                                      .why = kOfNewObjects,
                                                      .initial = "the user that starts the manager",
                                                      .meaning = "user of the pool; another one needs root"}),
    host<&HostConfig::pool_group, TextKey<GroupRule>>(
        {.name = "pool_group",
         .when = at_once,
         .why = kOfNewObjects,
         .initial = "the group of that user",
         .meaning = "group of the pool; another one needs root, or membership of the group"}),
    host<&HostConfig::pool_mode, ModeKey>(
        {.name = "pool_mode",
         .when = at_once,
         .why = kOfNewObjects,
         .meaning = "permission bits of the pool; also of its memories where nothing else is said. A pool "
                    "that is there already gets these rights, too, and the log says so; processes that have "
                    "it mapped keep it"}),
    host<&HostConfig::instance_user, TextKey<OwnUserRule>>(
        {.name = "instance_user",
         .when = next_manager,
         .why = "folders and pages of its instances get that user's rights at its start",
         .initial = "the user that starts the manager",
         .meaning =
             "user of the instances, see [Rights](install.md#rights). Another one needs a manager that "
             "is root; the manager's group is theirs, too"}),
    host<&HostConfig::instance_groups, TextKey<OptionalRule<AbsolutePathRule<kMaxPath>>>>(
        {.name = "instance_groups",
         .when = next_manager,
         .why = "running instances stay in their groups",
         .initial = "that of `plchost-instances.service` beside the manager's unit",
         .meaning = "folder of control groups (version 2) in which the manager makes one for each instance, "
                    "see [Control groups](install.md#control-groups)"}),
    host<&HostConfig::cores, CoresKey>({.name = "cores",
                                        .when = at_once,
                                        .initial = "the kernel's isolated cores, else all",
                                        .meaning = "where instances may run"}),
    host<&HostConfig::housekeeping_cores, CoresKey>({.name = "housekeeping_cores",
                                                     .when = at_once,
                                                     .initial = "those not in `cores`, else all",
                                                     .meaning = "where manager and API server run"}),
    host<&HostConfig::read_variables, WordKey<kReaderRoles>>(
        {.name = "read_variables",
         .when = new_server,
         .meaning = "the least [role](../api/security.md) that reads [variables](../instances/variables.md) "
                    "of instances. Without `identity` everybody can"}),
    host<&HostConfig::write_variables, WordKey<kWriterRoles>>(
        {.name = "write_variables",
         .when = new_server,
         .meaning = "the least role that writes, forces and unforces variables"}),
    host<&HostConfig::log_level, WordKey<kLogLevels>>(
        {.name = "log_level",
         .when = new_server,
         .meaning = "the least level that manager, API server and instances log"}),
    host<&HostConfig::allow_debug, TruthKey>(
        {.name = "allow_debug",
         .when = at_once,
         .why = "by commands of debuggers, and by processes that are started from then on",
         .meaning = "false: instances refuse applications that are debug builds, whose tasks an engineer can "
                    "halt"}),
    host<&HostConfig::keep_pool, TruthKey>(
        {.name = "keep_pool",
         .when = at_once,
         .meaning = "leave the pool in place at the end, for firmware that has it mapped"}),
};

constexpr std::array kDdsKeys = {
    dds<&DdsConfig::enabled, TruthKey>(
        {.name = "enabled", .when = new_server, .meaning = "false: no API server"}),
    dds<&DdsConfig::interface, TextKey<InterfaceRule>>(
        {.name = "interface",
         .when = new_server,
         .meaning =
             "network interface. Another one than `lo` needs `identity`, or `allow_unsecured = true`"}),
    dds<&DdsConfig::peers, TextsKey<kMaxPeers, PeerRule>>(
        {.name = "peers",
         .when = new_server,
         .initial = "none; on `lo` 127.0.0.1",
         .meaning = "addresses where other hosts are looked for: needed where there is no multicast, also to "
                    "see that a name is given twice"}),
    dds<&DdsConfig::multicast, TruthKey>(
        {.name = "multicast",
         .when = new_server,
         .meaning =
             "look for other hosts and clients by multicast, too; samples never go that way. Not on `lo`"}),
    dds<&DdsConfig::identity, TextKey<FolderRule>>(
        {.name = "identity",
         .when = new_server,
         .meaning = "folder of this host's identity, see [Security](../api/security.md): DDS Security is on. "
                    "`--check-config` looks at all of it; when the manager runs, a bad one keeps the API "
                    "server from starting and no instance"}),
    dds<&DdsConfig::user, TextKey<OwnUserRule>>(
        {.name = "user",
         .when = new_server,
         .initial = "the user that starts the manager",
         .meaning =
             "user of the API server, see [Rights](install.md#rights). Another one needs a manager that "
             "is root, and no `[blocks] host_number`; the manager's group is the server's, too"}),
    dds<&DdsConfig::allow_unsecured, TruthKey>(
        {.name = "allow_unsecured",
         .when = new_server,
         .meaning = "true: serve this interface without security; anyone on it can control the host"}),
};

constexpr std::array kBlocksKeys = {
    blocks<&BlocksConfig::host_number, NumberKey<0, kMaxHostNumber>>(
        {.name = "host_number",
         .when = new_server,
         .meaning = "how other hosts call this one, each differently; blocks go to and from their instances. "
                    "Needs `[dds]`; then no instance is called `gateway`. 0: no blocks between hosts"}),
    blocks<&BlocksConfig::base, TextKey<NameRule<kMaxBlockBase>>>(
        {.name = "base",
         .when = new_server,
         .meaning = "the nodes that other hosts reach, by their `[CmpBlkDrvShm] BaseName`"}),
};

constexpr std::array kInstanceKeys = {
    instance<&InstanceConfig::name, RequiredNameKey<kMaxInstanceName>>(
        {.name = "name",
         .when = at_once,
         .meaning = "name of the instance; another name is another instance"}),
    instance<&InstanceConfig::core, RequiredCoreKey>(
        {.name = "core",
         .when = next_process,
         .meaning = "the one core that all of its threads are bound to"}),
    instance<&InstanceConfig::share_core, TruthKey>(
        {.name = "share_core",
         .when = at_once,
         .meaning = "must be true for every instance on a core that is not exclusive"}),
    instance<&InstanceConfig::scheduler, SchedulerKey>(
        {.name = "scheduler",
         .when = next_process,
         .initial = "that of the settings (`[SysTimer] Linux.TimerMode`), else `CmpSchedule`",
         .meaning = "decides when a task is released"}),
    instance<&InstanceConfig::priority_band, WordKey<kPriorityBandNames>>(
        {.name = "priority_band",
         .when = next_process,
         .meaning = "the order of instances that share a core"}),
    instance<&InstanceConfig::memory_max_mib, NumberKey<kMinMemoryMib, kMaxMemoryMib>>(
        {.name = "memory_max_mib",
         .when = next_process,
         .initial = "no limit",
         .meaning = "the most memory of all its processes together, MiB. One that needs more is ended, with "
                    "all others of the instance"}),
    instance<&InstanceConfig::pids_max, NumberKey<kMinPids, kMaxPids>>(
        {.name = "pids_max",
         .when = next_process,
         .initial = "no limit",
         .meaning = "the most threads and processes that it has at a time; each task is a thread"}),
    instance<&InstanceConfig::oom_score, NumberKey<kMinOomScore, kMaxOomScore>>(
        {.name = "oom_score",
         .when = next_process,
         .meaning = "if the host has no memory left, the kernel ends processes with a high one first "
                    "(`oom_score_adj`). Other programs have 0, the manager has -900"}),
    instance<&InstanceConfig::settings, FileKey>(
        {.name = "settings",
         .when = next_process,
         .meaning = "the instance's own [settings file](../instances/settings.md)"}),
    instance<&InstanceConfig::application, FileKey>(
        {.name = "application", .when = next_process, .meaning = "the control program, a shared object"}),
    instance<&InstanceConfig::autostart, TruthKey>(
        {.name = "autostart",
         .when = next_start,
         .meaning = "starts with the host, until an operator starts or stops it: see [State that "
                    "survives](#state-that-survives)"}),
    instance<&InstanceConfig::after, TextsKey<kMaxInstances, InstanceRule>>(
        {.name = "after", .when = at_once, .meaning = "instances that must be up before"}),
    instance<&InstanceConfig::restart, WordKey<kRestartPolicyNames>>(
        {.name = "restart", .when = at_once, .meaning = "which ends of its process the manager restarts"}),
    instance<&InstanceConfig::restart_delay, TimeKey<milliseconds, 0, kMaxRestartDelayMs>>(
        {.name = "restart_delay_ms",
         .when = at_once,
         .meaning = "back-off, doubled with each failure in a row"}),
    instance<&InstanceConfig::restart_delay_max, TimeKey<milliseconds, 0, kMaxRestartDelayMs>>(
        {.name = "restart_delay_max_ms",
         .when = at_once,
         .meaning = "the longest back-off, at least `restart_delay_ms`"}),
    instance<&InstanceConfig::crash_limit, NumberKey<1, kMaxCrashLimit>>(
        {.name = "crash_limit",
         .when = at_once,
         .meaning = "so many crashes in `crash_window_s`: safe mode, up without its application"}),
    instance<&InstanceConfig::crash_window, TimeKey<seconds, 1, kMaxCrashWindowS>>(
        {.name = "crash_window_s", .when = at_once, .meaning = "the time in which crashes count"}),
};
static_assert(kHostKeys.size() == count_members<HostConfig>(), "each key of [host] has its row");
static_assert(kDdsKeys.size() == count_members<DdsConfig>(), "each key of [dds] has its row");
static_assert(kBlocksKeys.size() == count_members<BlocksConfig>(), "each key of [blocks] has its row");
static_assert(kInstanceKeys.size() == count_members<InstanceConfig>(),
              "each key of [[instance]] has its row");

}  // namespace

std::span<const ConfigRow<HostConfig>> host_keys() noexcept {
  return kHostKeys;
}
std::span<const ConfigRow<DdsConfig>> dds_keys() noexcept {
  return kDdsKeys;
}
std::span<const ConfigRow<BlocksConfig>> blocks_keys() noexcept {
  return kBlocksKeys;
}
std::span<const ConfigRow<InstanceConfig>> instance_keys() noexcept {
  return kInstanceKeys;
}

std::string config_key_table() {
  std::string table(kKeyTableHead);
  add_section(kHostKeys, table);
  add_section(kDdsKeys, table);
  add_section(kBlocksKeys, table);
  add_section(kInstanceKeys, table);
  return table;
}

}  // namespace plchost
