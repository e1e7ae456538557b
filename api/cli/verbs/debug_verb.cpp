// The verb "debug": a debugger of one instance, by commands or for another program.
#include <array>
#include <cstdio>
#include <memory>
#include <utility>

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include "api/cli/cli_session.hpp"
#include "api/cli/debug/dap_server.hpp"
#include "api/cli/debug/debug_console.hpp"
#include "api/cli/debug/debug_link.hpp"
#include "api/cli/interrupt.hpp"
#include "shm/base/names.hpp"
#include "shm/operations/operations.hpp"

namespace plchost {

namespace {

constexpr std::uint64_t kNoPort = 1ULL << 16U;

struct DebugArguments {
  std::string instance;
  std::vector<std::string> commands;
  std::uint64_t dap = kNoPort;
  bool take = false;
};

// Asks for the state, and tells nothing of it: the command "wait" does not count halts that were told before.
Result<void> keep_session(DebugLink& link) {
  PLCHOST_TRY(link.state());
  return {};
}

// The lines of standard input, until its end or "quit". If no line comes for 100 ms, the tasks that have
// halted are told.
Result<void> read_commands(DebugLink& link, DebugConsole& console) {
  constexpr int kIdleMs = 100;
  constexpr auto kKeep = std::chrono::seconds(2);
  TimePoint next_keep;
  const bool terminal = ::isatty(STDIN_FILENO) != 0;
  std::string pending;
  bool prompt = terminal;
  for (;;) {
    if (std::exchange(prompt, false)) {
      fmt::print("(debug) ");
      std::fflush(stdout);
    }
    pollfd ready{.fd = STDIN_FILENO, .events = POLLIN, .revents = 0};
    const int found = ::poll(&ready, 1, kIdleMs);
    if (interrupted()) return {};
    // Also between lines that ask for nothing, as comments: else the session would be over.
    if (const TimePoint now = MonotonicClock::now(); found <= 0 || now >= next_keep) {
      next_keep = now + kKeep;
      // A state that changes all the time is looked at again.
      const auto seen = found <= 0 ? console.look() : keep_session(link);
      if (!seen && seen.error().code != ErrorCode::busy) return seen;
    }
    if (found <= 0) continue;
    std::array<char, 4096> bytes{};
    const ssize_t got = ::read(STDIN_FILENO, bytes.data(), bytes.size());
    if (got <= 0) {
      if (!pending.empty()) (void)console.obey(pending);  // a last line without an end
      return {};
    }
    pending.append(bytes.data(), static_cast<std::size_t>(got));
    for (std::size_t end = pending.find('\n'); end != std::string::npos; end = pending.find('\n')) {
      const std::string line = pending.substr(0, end);
      pending.erase(0, end + 1);
      if (!console.obey(line)) return {};
      prompt = terminal;
    }
  }
}

int run_console(DebugLink& link, const DebugArguments& arguments) {
  catch_interrupts();
  const auto remark = link.attach(arguments.take);
  if (!remark) return CliSession::fail(remark.error());
  if (!remark->empty()) fmt::print("{}\n", printable(*remark));
  DebugConsole console(link);
  Result<void> done;
  if (arguments.commands.empty()) done = read_commands(link, console);
  for (const std::string& command : arguments.commands) {
    if (!console.obey(command) || console.failed()) break;
  }
  const auto left = link.detach();
  if (!done) return CliSession::fail(done.error());
  if (!left) return CliSession::fail(left.error());
  return console.failed() ? kExitFailed : kExitDone;
}

int debug(CliSession& session, const DebugArguments& arguments) {
  const auto host = session.target_host();
  if (!host) return CliSession::fail(host.error());
  if (const auto known = session.check_instance(arguments.instance); !known)
    return CliSession::fail(known.error());
  DebugLink link(debug_requests(session, *host, arguments.instance), *host, arguments.instance);
  try {
    if (arguments.dap == kNoPort) return run_console(link, arguments);
    const auto served = serve_dap(link, static_cast<std::uint16_t>(arguments.dap), arguments.take);
    return served ? kExitDone : CliSession::fail(served.error());
  } catch (const nlohmann::json::exception& error) {
    return CliSession::fail(
        {.code = ErrorCode::corrupt,
         .system_errno = 0,
         .message = fmt::format("the host's answer is not understood: {}", error.what())});
  }
}

}  // namespace

void add_debug_verb(const Command& plcctl, CliSession& session) {
  const auto arguments = std::make_shared<DebugArguments>();
  const char* const text = operation_of(ControlVerb::debug).help;
  plcctl.verb("debug", text)
      .noun("instance", text, [&session, arguments] { return debug(session, *arguments); })
      .argument("INSTANCE", arguments->instance)
      .optional("COMMAND", arguments->commands,
                "commands, each an argument, as 'break Main:7', wait and stack; 'help' lists them; none: the "
                "lines of standard input")
      .option("--dap", arguments->dap,
              "serve the Debug Adapter Protocol on this port of 127.0.0.1 until Ctrl-C (0: any free one)",
              std::uint64_t{0}, kNoPort - 1)
      .flag("--take", arguments->take, "also if another debugger has the session");
}

}  // namespace plchost
