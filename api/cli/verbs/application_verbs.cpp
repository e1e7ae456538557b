#include "api/cli/verbs/application_verbs.hpp"

#include <filesystem>
#include <map>
#include <memory>
#include <span>
#include <system_error>

#include <fmt/format.h>

#include "api/cli/progress_board.hpp"
#include "api/cli/rows/status_rows.hpp"
#include "api/cli/verbs/host_commands.hpp"
#include "api/client/application_file.hpp"
#include "api/dds/text.hpp"
#include "shm/operations/operations.hpp"

namespace plchost {

namespace {

struct LoadArguments {
  std::string instance;
  std::string file;
  bool on_host = false;
  bool boot = false;
  bool online = false;
};

constexpr const char* kBootHelp = "the instance starts with it from now on, also after a restart of the host";
constexpr const char* kOnlineHelp =
    "it takes over while the tasks run: no cycle is lost, variables go on; refused where it does not fit";

Async<Result<ApiReply>> send_to(ClientCore& core, Download download, TimePoint deadline,
                                ProgressBoard& board) {
  const DownloadProgressFunction show = [&](std::uint64_t received) { board.show(download.host, received); };
  auto reply = co_await core.download(download, show, deadline);
  board.end(download.host);
  co_return reply;
}

int send(CliSession& session, const LoadArguments& arguments) {
  const auto contents = read_application(arguments.file, " (a file on the host: --on-host)");
  if (!contents) return CliSession::fail(contents.error());
  const auto hosts = session.target_hosts();
  if (!hosts) return CliSession::fail(hosts.error());
  ProgressBoard board(*hosts, contents->size());
  const std::string name = std::filesystem::path(arguments.file).filename().string();
  const TimePoint deadline = session.deadline();
  return ask_hosts(session, *hosts, arguments.instance, [&](ClientCore& core, const std::string& host) {
    const Download download{.host = host,
                            .instance = arguments.instance,
                            .name = name,
                            .contents = std::as_bytes(std::span(*contents)),
                            .boot = arguments.boot,
                            .online = arguments.online};
    return send_to(core, download, deadline, board);
  });
}

int load(CliSession& session, const LoadArguments& arguments) {
  if (arguments.file.empty()) {
    return CliSession::fail({ErrorCode::invalid_argument, 0, "FILE is empty: name the application's file"});
  }
  if (!arguments.on_host) return send(session, arguments);
  std::error_code error;
  const std::string path = std::filesystem::absolute(arguments.file, error).lexically_normal();
  if (error) {
    return CliSession::fail({ErrorCode::system, error.value(),
                             fmt::format("FILE '{}' has no absolute path here", arguments.file)});
  }
  return command(
      session,
      {"", plc_OPERATION_LOAD_APPLICATION, arguments.instance, path, arguments.boot, arguments.online},
      done_text(operation_of(ControlVerb::load_application), path));
}

/// INSTANCE/PATH of what is loaded on a host.
Result<std::map<std::string, std::string>> loaded_on(CliSession& session, const std::string& host) {
  PLCHOST_TRY_ASSIGN(const auto instances, session.client().value()->instances(host, session.deadline()));
  std::map<std::string, std::string> loaded;
  for (const plc_InstanceStatus& status : instances) {
    loaded.emplace(dds::text_of(status.instance), dds::text_of(status.application));
  }
  return loaded;
}

int list_applications(CliSession& session, const std::string& instance) {
  if (!instance.empty()) {
    if (const auto known = session.check_instance(instance); !known) return CliSession::fail(known.error());
  }
  const auto hosts = session.shown_hosts();
  if (!hosts) return CliSession::fail(hosts.error());
  std::vector<Row> rows;
  for (const HostView& host : *hosts) {
    const auto kept = session.client().value()->applications(host.name, session.deadline());
    if (!kept) return CliSession::fail(kept.error());
    auto loaded = loaded_on(session, host.name);
    if (!loaded) return CliSession::fail(loaded.error());
    for (const plc_ApplicationStatus& status : *kept) {
      if (!instance.empty() && dds::text_of(status.instance) != instance) continue;
      const auto of_instance = loaded->find(std::string(dds::text_of(status.instance)));
      const bool is_loaded = of_instance != loaded->end() && of_instance->second == dds::text_of(status.path);
      rows.push_back(to_row(status, is_loaded));
      if (is_loaded) loaded->erase(of_instance);
    }
    // A file of the host, which nobody sent.
    for (const auto& [name, path] : *loaded) {
      if (path.empty() || (!instance.empty() && name != instance)) continue;
      plc_ApplicationStatus unsent{};
      dds::copy_text(unsent.host, host.name);
      dds::copy_text(unsent.instance, name);
      dds::copy_text(unsent.path, path);
      rows.push_back(to_row(unsent, true));
    }
  }
  return session.show(rows, columns_of<plc_ApplicationStatus>());
}

}  // namespace

void add_application_verbs(const Command& plcctl, CliSession& session) {
  const auto arguments = std::make_shared<LoadArguments>();
  const char* const text = operation_of(ControlVerb::load_application).help;
  plcctl.verb("load", text)
      .noun("application", text, [&session, arguments] { return load(session, *arguments); })
      .argument("INSTANCE", arguments->instance)
      .argument(
          "FILE", arguments->file,
          "the application: a file of this machine, which is sent; a relative path starts at the current "
          "directory")
      .flag("--on-host", arguments->on_host, "FILE is on the host already, and is loaded from there")
      .flag("--boot", arguments->boot, kBootHelp)
      .flag("--online", arguments->online, kOnlineHelp);
  const auto back_to = std::make_shared<LoadArguments>();
  const Operation& rollback = operation_of(ControlVerb::rollback_application);
  plcctl.verb("rollback", rollback.help)
      .noun("application", rollback.help,
            [&session, back_to, &rollback] {
              return command(session,
                             {"", plc_OPERATION_ROLLBACK_APPLICATION, back_to->instance, "", back_to->boot,
                              back_to->online},
                             done_text(rollback, ""));
            })
      .argument("INSTANCE", back_to->instance)
      .flag("--boot", back_to->boot, kBootHelp)
      .flag("--online", back_to->online, kOnlineHelp);
}

void add_list_applications(const Command& verb, CliSession& session) {
  const auto instance = std::make_shared<std::string>();
  verb.noun("applications", "The applications that were sent, as they are kept for each instance",
            [&session, instance] { return list_applications(session, *instance); })
      .optional("INSTANCE", *instance, "only of this instance");
}

}  // namespace plchost
