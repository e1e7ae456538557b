// The commands of a Client.
#include <filesystem>
#include <span>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "api/client/application_file.hpp"
#include "api/library/calls.hpp"
#include "api/library/convert.hpp"
#include "api/library/worker.hpp"
#include "shm/base/names.hpp"
#include "shm/operations/operations.hpp"

namespace plchost {

namespace {

Client::Outcome outcome_of(const Result<ApiReply>& reply) {
  if (!reply)
    return {.code = static_cast<int>(reply.error().code), .text = reply.error().describe(), .posted = {}};
  return {.code = static_cast<int>(reply->code), .text = reply->text, .posted = {}};
}

std::string text_or_throw(const Client::Outcome& outcome) {
  if (!outcome) throw ClientError(outcome.code, outcome.text);
  return outcome.text;
}

// Of those that only read, the answer is more than the text of a Reply; a download has contents.
bool is_command(const Operation& known) {
  return known.place != OperationPlace::internal && !known.only_reads &&
         known.options != OperationOptions::download;
}

std::string_view argument_name(OperationArgument argument) {
  switch (argument) {
    case OperationArgument::none:
      return "";
    case OperationArgument::path:
      return "path";
    case OperationArgument::file:
      return "file";
    case OperationArgument::scheduler:
      return "scheduler";
    case OperationArgument::event:
      return "event";
    case OperationArgument::task_or_none:
      return "task";
    case OperationArgument::variable_value:
      return "variable=value";
    case OperationArgument::variable_or_all:
      return "variable";
    case OperationArgument::debug_command:
      return "command";
  }
  return "";
}

Result<const Operation*> find_command(const std::string& name) {
  const Operation* const known = find_operation(name);
  if (known != nullptr && is_command(*known)) return known;
  std::vector<std::string_view> names;
  for (const Operation& operation : operations()) {
    if (is_command(operation)) names.push_back(operation.name);
  }
  return failure(ErrorCode::invalid_argument,
                 fmt::format("no command '{}'; there are: {}", shown(name), join_names(names)));
}

Result<ApiRequest> request_of(const std::string& name, const std::string& host, const std::string& instance,
                              const std::string& argument, const LoadOptions& options) {
  PLCHOST_TRY_ASSIGN(const auto known, find_command(name));
  if ((options.boot || options.online) && known->options == OperationOptions::none) {
    return failure(ErrorCode::invalid_argument, fmt::format("'{}' takes no options of loading", name));
  }
  return ApiRequest{host,          static_cast<std::int32_t>(known->verb), instance, argument, options.boot,
                    options.online};
}

/// `request.host`: empty: the only one.
Async<Result<ApiReply>> ask(CallOrder& order, ClientCore& core, ApiRequest request) {
  PLCHOST_CO_TRY_ASSIGN(const auto place, co_await order.place(core, request.host));
  request.host = place.host;
  co_return co_await core.call(request, place.deadline);
}

/// A file that is to be sent.
struct Sending {
  std::string host;  // empty: the only one
  std::string instance;
  std::string file;
  LoadOptions options;
  Client::Progress progress;
};

Async<Result<ApiReply>> send(CallOrder& order, ClientCore& core, Sending sending) {
  PLCHOST_CO_TRY_ASSIGN(const auto contents, read_application(sending.file));
  PLCHOST_CO_TRY_ASSIGN(auto place, co_await order.place(core, sending.host));
  Turns::Turn turn(order.downloads(place.host), core.pump());
  place.let_others_go();
  while (!turn.has_come()) co_await turn.come();
  if (order.has_ended()) co_return client_has_ended();
  const Download download{.host = place.host,
                          .instance = sending.instance,
                          .name = std::filesystem::path(sending.file).filename().string(),
                          .contents = std::as_bytes(std::span(contents)),
                          .boot = sending.options.boot,
                          .online = sending.options.online};
  co_return co_await core.download(download, sending.progress, order.deadline());
}

}  // namespace

std::vector<Client::Operation> Client::operations() {
  std::vector<Operation> all;
  for (const plchost::Operation& known : plchost::operations()) {
    if (!is_command(known)) continue;
    all.push_back({.name = std::string(known.name),
                   .argument = std::string(argument_name(known.argument)),
                   .may_be_left_out = known.argument == OperationArgument::task_or_none,
                   .help = known.help,
                   .names_instance = known.names_instance,
                   .engineering = known.role == ApiRole::engineering,
                   .loads = known.options == OperationOptions::loading});
  }
  return all;
}

std::string Client::command(const std::string& operation, const std::string& host,
                            const std::string& instance, const std::string& argument,
                            const LoadOptions& options) {
  const ApiRequest request = value_or_throw(request_of(operation, host, instance, argument, options));
  return text_or_throw(outcome_of(
      worker_->run<ApiReply>([&](ClientCore& core) { return ask(worker_->order(), core, request); })));
}

void Client::command(const std::string& operation, const std::string& host, const std::string& instance,
                     const std::string& argument, std::function<void(const Outcome&)> done,
                     const LoadOptions& options) {
  check_callback(static_cast<bool>(done));
  worker_->begin<ApiReply>(
      [this, request = value_or_throw(request_of(operation, host, instance, argument, options))](
          ClientCore& core) { return ask(worker_->order(), core, request); },
      [done = std::move(done)](const Result<ApiReply>& reply) { done(outcome_of(reply)); });
}

std::string Client::download_application(const std::string& host, const std::string& instance,
                                         const std::string& file, const LoadOptions& options,
                                         const Progress& progress) {
  // A callback that waits for its own download is told its progress meanwhile.
  const Sending sending{host, instance, file, options,
                        worker_->is_here() ? progress : worker_->in_turn(progress)};
  return text_or_throw(outcome_of(worker_->run<ApiReply>(
      [&](ClientCore& core) { return send(worker_->order(), core, sending); }, Worker::Telling::in_turn)));
}

void Client::download_application(const std::string& host, const std::string& instance,
                                  const std::string& file, const LoadOptions& options,
                                  const Progress& progress, std::function<void(const Outcome&)> done) {
  check_callback(static_cast<bool>(done));
  worker_->begin<ApiReply>(
      [this, sending = Sending{host, instance, file, options, worker_->in_turn(progress)}](ClientCore& core) {
        return send(worker_->order(), core, sending);
      },
      [done = std::move(done)](const Result<ApiReply>& reply) { done(outcome_of(reply)); });
}

std::string Client::start(const std::string& host, const std::string& instance) {
  return command("start", host, instance);
}

std::string Client::stop(const std::string& host, const std::string& instance) {
  return command("stop", host, instance);
}

std::string Client::restart(const std::string& host, const std::string& instance) {
  return command("restart", host, instance);
}

std::string Client::reset(const std::string& host, const std::string& instance, bool cold) {
  return command(cold ? "reset cold" : "reset", host, instance);
}

std::string Client::single_cycle(const std::string& host, const std::string& instance) {
  return command("single cycle", host, instance);
}

std::string Client::load_application(const std::string& host, const std::string& instance,
                                     const std::string& path, const LoadOptions& options) {
  return command("load application", host, instance, path, options);
}

std::string Client::rollback_application(const std::string& host, const std::string& instance,
                                         const LoadOptions& options) {
  return command("rollback application", host, instance, {}, options);
}

std::string Client::set_scheduler(const std::string& host, const std::string& instance,
                                  const std::string& scheduler) {
  return command("set scheduler", host, instance, scheduler);
}

std::string Client::register_event(const std::string& host, const std::string& event) {
  const auto id = value_or_throw(event_of(event));
  return command("register event", host, id.instance, id.event);
}

std::string Client::unregister_event(const std::string& host, const std::string& event) {
  const auto id = value_or_throw(event_of(event));
  return command("unregister event", host, id.instance, id.event);
}

std::string Client::reload(const std::string& host) {
  return command("reload host", host);
}

}  // namespace plchost
