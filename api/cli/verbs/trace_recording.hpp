#pragma once

#include <string_view>

#include "api/cli/cli_session.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// "5s", "500ms", "2m", "1h", or seconds as a number; at most an hour. invalid_argument says what is allowed.
[[nodiscard]] Result<Duration> parse_recording_time(std::string_view text);

/// "record trace", with its verb.
void add_record_trace(const Command& plcctl, CliSession& session);

}  // namespace plchost
