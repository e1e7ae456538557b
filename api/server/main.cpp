#include <csignal>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "api/control/exit_codes.hpp"
#include "api/dds/cyclone_version.h"
#include "api/dds/gate/host_mark.hpp"
#include "api/server/access/own_user.hpp"
#include "api/server/access/receive_gate.hpp"
#include "api/server/control_server.hpp"
#include "api/server/heap_trim.hpp"
#include "shm/base/names.hpp"
#include "shm/files/memory_rights.hpp"
#include "shm/guard/memory_guard.hpp"
#include "shm/log/log.hpp"
#include "shm/log/log_levels.hpp"
#include "shm/pages/host_words.hpp"
#include "shm/process/end_with_parent.hpp"

namespace {

// Above soft threads, far below every task.
constexpr int kReceiveFifo = 20;
constexpr int kMostFifo = kReceiveFifo + 1;  // of the loop that serves posts
constexpr int kExitFailed = 1;
constexpr int kExitUsage = 2;

int fail(const plchost::Error& error) {
  spdlog::error("{}", error.describe());
  return error.code == plchost::ErrorCode::already_exists ? plchost::kExitNameTaken : kExitFailed;
}

}  // namespace

int main(int argc, char** argv) {
  plchost::MemoryGuard::watch_process();
  plchost::give_large_blocks_back();
  plchost::ServerOptions options;
  options.pool = "plchost";
  std::string log_level = "info";
  std::string user;
  std::vector<uid_t> instance_users;
  pid_t parent = 0;
  CLI::App app("plchost-dds: the API server of plchost, started by plchostd");
  app.set_version_flag("--version", PLCHOST_VERSION);
  app.add_option("--host", options.host, "name of this host in the DDS domain")->required();
  app.add_option("--domain", options.dds.domain, "DDS domain")->check(CLI::Range(0U, plchost::kMaxDdsDomain));
  app.add_option("--pool", options.pool, "name of the object pool");
  app.add_option("--run-directory", options.run_directory, "where the manager's socket is")->required();
  app.add_option("--interface", options.dds.interfaces, "network interfaces (default: lo)");
  app.add_option("--peer", options.dds.peers, "addresses to announce this host to");
  app.add_option("--identity", options.dds.identity,
                 "folder of this host's identity (default: none, and no security)");
  app.add_flag("--allow-unsecured", options.allow_unsecured,
               "without --identity: allow interfaces that others reach");
  app.add_option("--host-number", options.host_number,
                 "number of this host for blocks between hosts; 0: none")
      ->check(CLI::Range(std::uint16_t{0}, plchost::kMaxHostNumber));
  app.add_option("--blocks-base", options.blocks_base, "base name of the nodes that send blocks");
  const auto role = [&app](const char* option, plchost::security::Role& target, const auto& words,
                           const char* help) {
    app.add_option_function<std::string>(
           option,
           [&target](const std::string& word) { target = plchost::security::parse_role(word).value(); }, help)
        ->check(CLI::IsMember(std::vector<std::string>(words.begin(), words.end())));
  };
  role("--read-variables", options.variable_rights.read, plchost::kReaderRoles,
       "the role that reads variables of a secured host");
  role("--write-variables", options.variable_rights.write, plchost::kWriterRoles,
       "the role that writes and forces them");
  app.add_option("--label", options.labels, "by which clients choose hosts");
  app.add_option("--audit-folder", options.audit_folder, "folder of the log of changes by clients");
  app.add_option("--name-since", options.name_since_ns,
                 "since when this host has its name (CLOCK_REALTIME, ns; default: now)");
  app.add_option("--beat-fd", options.beat_fd,
                 "eventfd of the manager, which sees by it that this process runs");
  app.add_flag("--name-held", options.name_held, "a server before this one had the name: do not ask for it");
  app.add_flag("--name-refused", options.name_refused,
               "a server before this one was refused the name: ask for it longer");
  app.add_flag("--no-multicast{false}", options.dds.multicast, "look for others at --peer only");
  app.add_option("--applications-folder", options.applications_folder,
                 "where the manager keeps the applications that were sent");
  app.add_option("--application-limit", options.application_limit_mib, "the largest of them, MiB")
      ->check(CLI::Range(1U, plchost::kMaxApplicationMib));
  app.add_option("--user", user,
                 "run as this user, with no other rights than the API needs (default: that of the caller)");
  app.add_option("--instance-user", instance_users, "numbers of the users that instances run as");
  app.add_option("--parent", parent, "be killed when this process ends, which has started this one")
      ->check(CLI::NonNegativeNumber);
  app.add_option("--log-level", log_level, plchost::join_names(plchost::kLogLevels))
      ->check(
          CLI::IsMember(std::vector<std::string>(plchost::kLogLevels.begin(), plchost::kLogLevels.end())));
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : kExitUsage;
  }
  plchost::start_log("plchost-dds", log_level);
  for (const uid_t one : instance_users) plchost::trust_instances_of(one);
  options.own_user = !user.empty();
  if (options.own_user) {
    const auto become =
        plchost::become_user({.user = user,
                              .most_fifo = kMostFifo,
                              .files = plchost::files_of_server({.run = options.run_directory,
                                                                 .audit = options.audit_folder,
                                                                 .applications = options.applications_folder,
                                                                 .identity = options.dds.identity})});
    if (!become) return fail(plchost::failure_in("[dds] user", become.error()).error());
    spdlog::info("runs as user {}, without capabilities; files: {}", user,
                 become->empty() ? "those that it needs" : *become);
  }
  // Also one that hangs or is stopped: two of one host would write over each other's status.
  if (parent != 0 && !plchost::end_with_parent(parent, SIGKILL)) return kExitFailed;
  (void)std::signal(SIGPIPE, SIG_IGN);
  if (const char* const why = plc_unknown_cyclone(); why != nullptr)
    spdlog::warn("{}: memory of clients that have ended is not given back", why);
  options.dds.receive_fifo = plchost::dds::can_use_fifo(kReceiveFifo) ? kReceiveFifo : 0;
  const plchost::dds::HostMark mark{.name = options.host, .sends_blocks = options.host_number != 0};
  plchost::close_receive_gate(!options.dds.identity.empty(), mark);
  options.announced = plchost::dds::words_of(mark);
  options.refused_datagrams = plchost::datagrams_refused;
  const auto server = plchost::ControlServer::create(std::move(options));
  if (!server) return fail(server.error());
  const auto done = (*server)->run();
  return done ? 0 : fail(done.error());
}
