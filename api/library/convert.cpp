#include "api/library/convert.hpp"

#include <chrono>
#include <ranges>
#include <tuple>
#include <utility>

#include <fmt/format.h>

#include "api/client/status_count.hpp"
#include "api/dds/code_names.hpp"
#include "api/dds/text.hpp"

namespace plchost {

namespace {

std::string text(std::string_view from) {
  return std::string(from);
}

// Of "a,b".
std::vector<std::string> words_of(std::string_view list) {
  std::vector<std::string> words;
  for (const auto word : std::views::split(list, ',')) words.emplace_back(std::string_view(word));
  return words;
}

std::chrono::system_clock::time_point wall_time(std::int64_t unix_ns) {
  return std::chrono::system_clock::time_point(
      std::chrono::duration_cast<std::chrono::system_clock::duration>(std::chrono::nanoseconds(unix_ns)));
}

// The numbers of ErrorCode that users see; newer ones say what they are by their text.
static_assert(static_cast<int>(ErrorCode::invalid_argument) == ClientError::invalid_argument);
static_assert(static_cast<int>(ErrorCode::not_found) == ClientError::not_found);
static_assert(static_cast<int>(ErrorCode::already_exists) == ClientError::already_exists);
static_assert(static_cast<int>(ErrorCode::wrong_state) == ClientError::wrong_state);
static_assert(static_cast<int>(ErrorCode::refused) == ClientError::refused);
static_assert(static_cast<int>(ErrorCode::busy) == ClientError::busy);
static_assert(static_cast<int>(ErrorCode::timed_out) == ClientError::timed_out);
static_assert(static_cast<int>(ErrorCode::unavailable) == ClientError::unavailable);
static_assert(static_cast<int>(ErrorCode::system) == ClientError::failed);
static_assert(static_cast<int>(ErrorCode::unsupported) == ClientError::unsupported);
static_assert(static_cast<int>(ErrorCode::full) == ClientError::full);
static_assert(static_cast<int>(ErrorCode::corrupt) == ClientError::corrupt);

auto all_of(const Client::Host& h) {
  return std::tie(h.answers, h.version, h.labels, h.instances, h.manager_pid, h.started);
}

auto all_of(const Client::Instance& i) {
  return std::tie(i.state, i.pid, i.core, i.restarts, i.scheduler, i.application, i.problem, i.loaded,
                  i.configured, i.settings, i.priority_band, i.after, i.autostart, i.restart, i.restart_delay,
                  i.restart_delay_max, i.crash_limit, i.crash_window);
}

auto all_of(const Client::Task& t) {
  return std::tie(t.kind, t.priority, t.state, t.interval, t.external_event, t.cycles, t.lost_cycles,
                  t.lost_events, t.execution_last, t.execution_average, t.execution_max, t.latency_median,
                  t.latency_max, t.jitter_max);
}

auto all_of(const Client::Event& e) {
  return std::tie(e.registered, e.bound_tasks, e.posts);
}

}  // namespace

Client::Host to_public(const HostView& host, bool answers) {
  return {.name = host.name,
          .answers = answers,
          .version = text(dds::text_of(host.status.version)),
          .labels = host.labels(),
          .instances = count_of<plc_InstanceStatus>(host.status).value_or(0),
          .manager_pid = host.status.manager_pid,
          .started = wall_time(host.status.started_unix_ns)};
}

Client::Instance to_public(const plc_InstanceStatus& status) {
  return {.host = text(dds::text_of(status.host)),
          .name = text(dds::text_of(status.instance)),
          .state = dds::instance_state_name(status.state),
          .pid = status.pid,
          .core = status.core,
          .restarts = status.restarts,
          .scheduler = text(dds::text_of(status.scheduler)),
          .application = text(dds::text_of(status.application)),
          .problem = text(dds::text_of(status.problem)),
          .loaded = text(dds::text_of(status.loaded)),
          .configured = text(dds::text_of(status.configured)),
          .settings = text(dds::text_of(status.settings)),
          .priority_band = text(dds::text_of(status.priority_band)),
          .after = words_of(dds::text_of(status.after)),
          .autostart = status.autostart,
          .restart = dds::restart_policy_name(status.restart_policy),
          .restart_delay = std::chrono::nanoseconds(status.restart_delay_ns),
          .restart_delay_max = std::chrono::nanoseconds(status.restart_delay_max_ns),
          .crash_limit = status.crash_limit,
          .crash_window = std::chrono::nanoseconds(status.crash_window_ns)};
}

Client::Task to_public(const plc_TaskStatus& status) {
  using Ns = std::chrono::nanoseconds;
  return {.host = text(dds::text_of(status.host)),
          .instance = text(dds::text_of(status.instance)),
          .name = text(dds::text_of(status.task)),
          .kind = dds::task_kind_name(status.kind),
          .priority = status.priority,
          .state = dds::task_state_name(status.state),
          .interval = Ns(status.interval_ns),
          .external_event = text(dds::text_of(status.external_event)),
          .cycles = status.cycles,
          .lost_cycles = status.lost_cycles,
          .lost_events = status.lost_events,
          .execution_last = Ns(status.exec_last_ns),
          .execution_average = Ns(status.exec_avg_ns),
          .execution_max = Ns(status.exec_max_ns),
          .latency_median = Ns(status.latency_p50_ns),
          .latency_max = Ns(status.latency_max_ns),
          .jitter_max = Ns(status.jitter_max_ns)};
}

Client::Event to_public(const plc_EventStatus& status) {
  return {.host = text(dds::text_of(status.host)),
          .instance = text(dds::text_of(status.instance)),
          .name = text(dds::text_of(status.event)),
          .registered = status.registered,
          .bound_tasks = status.bound_tasks,
          .posts = status.posts};
}

Client::Transition to_public(const TransitionView& transition) {
  const plc_Transition& sample = transition.sample;
  return {.host = text(dds::text_of(sample.host)),
          .instance = text(dds::text_of(sample.instance)),
          .of = sample.source == 0 ? "application" : "process",
          .from = dds::transition_state_name(sample.source, sample.from_state),
          .to = dds::transition_state_name(sample.source, sample.to_state),
          .reason = text(dds::text_of(sample.reason)),
          .pid = sample.pid,
          .time = wall_time(sample.time_unix_ns),
          .number = sample.sequence_number,
          .missed = transition.missed};
}

Client::LogLine to_public(const LogText& line) {
  return {.host = {},
          .instance = {},
          .text = line.text,
          .level = text(dds::log_level_name(std::to_underlying(line.level))),
          .source = text(dds::log_source_name(std::to_underlying(line.source))),
          .pid = line.pid,
          .time = wall_time(line.time_unix_ns),
          .number = line.sequence,
          .missing = line.missing,
          .stream = 0};
}

Client::Outcome to_public(const PostReport& report) {
  Client::Outcome outcome{
      .code = 0, .text = {}, .posted = {.accepted = report.accepted, .no_task = report.no_task}};
  if (report.unacknowledged > 0) {
    outcome.code = ClientError::timed_out;
    outcome.text = fmt::format("the host has stopped answering: the fate of {} posts is not known",
                               report.unacknowledged);
  } else if (report.rejected > 0) {
    outcome.code = static_cast<int>(report.rejected_code);
    outcome.text =
        fmt::format("{} posted, {} rejected: {}", report.accepted, report.rejected, report.rejected_text);
  }
  return outcome;
}

bool is_same(const Client::Host& a, const Client::Host& b) {
  return all_of(a) == all_of(b);
}
bool is_same(const Client::Instance& a, const Client::Instance& b) {
  return all_of(a) == all_of(b);
}
bool is_same(const Client::Task& a, const Client::Task& b) {
  return all_of(a) == all_of(b);
}
bool is_same(const Client::Event& a, const Client::Event& b) {
  return all_of(a) == all_of(b);
}

void check_callback(bool given) {
  if (!given) throw_client_error({ErrorCode::invalid_argument, 0, "no callback is given"});
}

void throw_client_error(const Error& error) {
  throw ClientError(static_cast<int>(error.code), error.describe());
}

}  // namespace plchost
