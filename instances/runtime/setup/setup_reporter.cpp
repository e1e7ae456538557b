#include "instances/runtime/setup/setup_reporter.hpp"

#include <fmt/format.h>

#include "shm/base/names.hpp"
#include "shm/base/transient.hpp"
#include "shm/log/log.hpp"

namespace plchost {

namespace {

// A reason that does not fit is worth more cut than not told.
std::string packet_of(SetupReport report) {
  std::string packet = encode(report);
  if (packet.size() <= kMaxPacket) return packet;
  constexpr std::size_t kFits = kMaxPacket / 8;  // as JSON, a byte takes six at most
  report.text = fmt::format("{} ... ({} bytes in all)", cut(report.text, kFits), report.text.size());
  return encode(report);
}

}  // namespace

SetupReporter::SetupReporter(int report_fd) : socket_(UniqueFd(report_fd)) {}

void SetupReporter::report(const SetupReport& report) {
  if (socket_) {
    // A manager that is gone, or that does not read, is no reason to stop: the instance runs on without it.
    if (const auto sent = socket_.send(packet_of(report)); sent) return;
    spdlog::warn("the set-up report could not be sent; it follows here");
    socket_.close();
  }
  if (report.code != ErrorCode::ok) {
    spdlog::error("{} failed: {}", to_string(report.step), report.text);
  } else if (!report.text.empty()) {
    spdlog::warn("{}: {}", to_string(report.step), report.text);
  } else {
    spdlog::debug("{}: done", to_string(report.step));
  }
}

void SetupReporter::done(SetupStep step, std::string_view remark) {
  report({.step = step, .code = ErrorCode::ok, .text = std::string(remark)});
}

void SetupReporter::failed(SetupStep step, const Error& error) {
  report({.step = step, .code = error.code, .text = error.describe(), .transient = is_transient(error)});
}

}  // namespace plchost
