#include <charconv>
#include <ctime>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "api/cli/cli_session.hpp"
#include "api/cli/interrupt.hpp"
#include "api/cli/output.hpp"
#include "api/cli/rows/log_rows.hpp"
#include "api/recording/variable_recording.hpp"
#include "shm/base/names.hpp"

namespace plchost {

namespace {

constexpr std::uint64_t kAllLines = kMaxCount;

struct LogArguments {
  std::string instance;
  std::uint64_t count = kAllLines;
  std::string since;
  bool follow = false;
};

/// Where --since begins: so long before the host's clock, or at a time.
struct Since {
  std::int64_t before_ns = 0;
  std::int64_t unix_ns = 0;

  [[nodiscard]] std::int64_t by_clock(std::int64_t clock_unix_ns) const noexcept {
    return before_ns > 0 ? clock_unix_ns - before_ns : unix_ns;
  }
};

std::optional<Since> parse_age(std::string_view text) {
  constexpr std::int64_t kNsOfASecond = 1'000'000'000;
  constexpr std::int64_t kMostSeconds = 1'000'000'000;
  std::int64_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  const std::string_view unit = text.substr(static_cast<std::size_t>(end - text.data()));
  const std::int64_t seconds = unit == "s"   ? 1
                               : unit == "m" ? 60
                               : unit == "h" ? 3600
                               : unit == "d" ? 86'400
                                             : 0;
  if (error != std::errc{} || seconds == 0 || number <= 0 || number > kMostSeconds / seconds) {
    return std::nullopt;
  }
  return Since{.before_ns = number * seconds * kNsOfASecond, .unix_ns = 0};
}

Result<Since> parse_since(const std::string& text) {
  if (text.empty()) return Since{};
  if (const auto age = parse_age(text)) return *age;
  std::tm parts{};
  const char* const end = ::strptime(text.c_str(), "%Y-%m-%dT%H:%M:%S", &parts);
  const std::string_view rest = end != nullptr ? std::string_view(end) : std::string_view("none");
  const bool fraction = rest.starts_with('.') && rest.ends_with('Z') && rest.size() <= 11 &&
                        rest.find_first_not_of("0123456789", 1) == rest.size() - 1;
  if (rest == "Z" || rest.empty() || fraction) {
    return Since{.before_ns = 0, .unix_ns = ::timegm(&parts) * std::int64_t{1'000'000'000}};
  }
  return failure(ErrorCode::invalid_argument,
                 fmt::format("--since '{}': allowed are 90s, 10m, 2h, 1d, or a time as the log tells it: "
                             "2026-11-21T10:48:59Z",
                             shown(text)));
}

/// The part of the log of one instance that is shown.
class LogFollower {
 public:
  LogFollower(CliSession& session, std::string host, const LogArguments& arguments, Since since)
      : session_(session), log_(std::move(host), arguments.instance), arguments_(arguments), since_(since) {}

  /// The new lines; the first time, the kept ones that were asked for.
  Result<std::vector<LogText>> read() {
    ControlClient& client = *session_.client().value();
    PLCHOST_TRY_ASSIGN(auto lines,
                       client.wait(log_.read(client.core(), session_.deadline(), arguments_.count)));
    const std::int64_t begin = since_.by_clock(log_.clock_unix_ns());
    std::erase_if(lines, [&](const LogText& line) { return line.last.time_unix_ns < begin; });
    return lines;
  }
  [[nodiscard]] const std::string& host() const noexcept { return log_.host(); }

 private:
  CliSession& session_;
  LogReader log_;
  const LogArguments& arguments_;
  Since since_;
};

int show_lines(const CliSession& session, const LogArguments& arguments, const std::string& host,
               const std::vector<LogText>& lines) {
  const CliOptions& options = session.options;
  const bool as_rows =
      options.json || options.csv || options.wide || !options.columns.empty() || !options.sort_by.empty();
  if (as_rows) {
    std::vector<Row> rows;
    for (const LogText& line : lines) rows.push_back(to_row(host, arguments.instance, line));
    return session.show(std::move(rows), columns_of<plc_LogRecord>());
  }
  for (const LogText& line : lines) fmt::print("{}", format_log_line(line));
  return kExitDone;
}

void print_news(const CliSession& session, const LogArguments& arguments, const std::string& host,
                const std::vector<LogText>& lines) {
  for (const LogText& line : lines) {
    if (session.options.json) {
      fmt::print("{}\n", json_text(to_row(host, arguments.instance, line)));
    } else {
      fmt::print("{}", format_log_line(line));
    }
  }
  flush_output();
}

int follow(const CliSession& session, LogFollower& log, const LogArguments& arguments) {
  constexpr Duration kPeriod = std::chrono::milliseconds(250);
  bool silent = false;
  for (bool first = true; !interrupted(); first = false) {
    const auto lines = log.read();
    if (lines) {
      silent = false;
      print_news(session, arguments, log.host(), *lines);
    } else if (first || !comes_back(lines.error())) {
      return CliSession::fail(lines.error());
    } else if (!std::exchange(silent, true)) {
      (void)CliSession::fail(lines.error());
    }
    sleep_until_interrupted(MonotonicClock::now() + kPeriod);
  }
  return kExitDone;
}

int logs(CliSession& session, const LogArguments& arguments) {
  const auto since = parse_since(arguments.since);
  if (!since) return CliSession::fail(since.error());
  const auto host = session.target_host();
  if (!host) return CliSession::fail(host.error());
  LogFollower log(session, *host, arguments, *since);
  if (arguments.follow) {
    catch_interrupts();
    return follow(session, log, arguments);
  }
  const auto lines = log.read();
  return lines ? show_lines(session, arguments, *host, *lines) : CliSession::fail(lines.error());
}

}  // namespace

void add_logs_verb(const Command& plcctl, CliSession& session) {
  const auto arguments = std::make_shared<LogArguments>();
  plcctl
      .noun("logs",
            "The lines of an instance: of its application, of its runtime, and of the manager about it",
            [&session, arguments] { return logs(session, *arguments); })
      .argument("INSTANCE", arguments->instance)
      .flag("-f,--follow", arguments->follow,
            "go on with new lines, until Ctrl-C (with --json one object a line)")
      .option("-n,--lines", arguments->count, "only so many of the newest lines", std::uint64_t{0}, kMaxCount)
      .optional("--since", arguments->since,
                "only lines from then on: 90s, 10m, 2h, 1d ago by the host's clock, or 2026-11-21T10:48:59Z");
}

}  // namespace plchost
