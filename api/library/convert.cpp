#include "api/library/convert.hpp"

#include <cstddef>
#include <utility>

#include <code_words.hpp>
#include <fmt/format.h>

#include "api/client/status_count.hpp"
#include "api/dds/code_names.hpp"
#include "api/dds/text.hpp"
#include "shm/base/names.hpp"

namespace plchost {

namespace {

// The code that users see. A new ErrorCode does not compile until it has a ClientError::Code and a word in
// Reply.code.
constexpr int public_code(ErrorCode code) {
  switch (code) {
    case ErrorCode::ok:
      return 0;
    case ErrorCode::invalid_argument:
      return ClientError::invalid_argument;
    case ErrorCode::not_found:
      return ClientError::not_found;
    case ErrorCode::already_exists:
      return ClientError::already_exists;
    case ErrorCode::wrong_state:
      return ClientError::wrong_state;
    case ErrorCode::refused:
      return ClientError::refused;
    case ErrorCode::busy:
      return ClientError::busy;
    case ErrorCode::timed_out:
      return ClientError::timed_out;
    case ErrorCode::unavailable:
      return ClientError::unavailable;
    case ErrorCode::system:
      return ClientError::failed;
    case ErrorCode::unsupported:
      return ClientError::unsupported;
    case ErrorCode::full:
      return ClientError::full;
    case ErrorCode::corrupt:
      return ClientError::corrupt;
    case ErrorCode::wrong_type:
      return ClientError::wrong_type;
    case ErrorCode::wrong_size:
      return ClientError::wrong_size;
  }
  return -1;
}

constexpr bool each_is_told_by_its_number() {
  constexpr std::size_t kCodes = dds::words::Reply::code.size();
  for (std::size_t code = 0; code < kCodes; ++code) {
    if (public_code(static_cast<ErrorCode>(code)) != static_cast<int>(code)) return false;
  }
  return kCodes == static_cast<std::size_t>(ClientError::wrong_size) + 1;
}
static_assert(each_is_told_by_its_number());

}  // namespace

Client::Host to_public(const HostView& host, bool answers) {
  Client::Host made;
  static_cast<client_types::Host&>(made) = to_public(host.status);
  made.name = host.name;
  made.answers = answers;
  made.instances = count_of<plc_InstanceStatus>(host.status).value_or(0);
  return made;
}

Client::Transition to_public(const TransitionView& transition) {
  const plc_Transition& sample = transition.sample;
  Client::Transition made;
  static_cast<client_types::Transition&>(made) = to_public(sample);
  made.from_state = dds::transition_state_name(sample.source, sample.from_state);
  made.to_state = dds::transition_state_name(sample.source, sample.to_state);
  made.missed = transition.missed;
  return made;
}

Client::LogLine to_public(const LogText& line) {
  Client::LogLine made;
  static_cast<client_types::LogLine&>(made) = to_public(line.last);
  made.text = line.text;
  made.missing = line.missing;
  return made;
}

Client::Outcome to_public(const PostReport& report) {
  Client::Outcome outcome{
      .code = 0, .text = {}, .posted = {.accepted = report.accepted, .no_task = report.no_task}};
  if (report.unacknowledged > 0) {
    outcome.code = ClientError::timed_out;
    outcome.text = fmt::format("the host has stopped answering: the fate of {} is not known",
                               count_text(report.unacknowledged, "post"));
  } else if (report.rejected > 0) {
    outcome.code = static_cast<int>(report.rejected_code);
    outcome.text =
        fmt::format("{} posted, {} rejected: {}", report.accepted, report.rejected, report.rejected_text);
  }
  return outcome;
}

void check_callback(bool given) {
  if (!given) throw_client_error({ErrorCode::invalid_argument, 0, "no callback is given"});
}

void throw_client_error(const Error& error) {
  throw ClientError(static_cast<int>(error.code), error.describe());
}

}  // namespace plchost
