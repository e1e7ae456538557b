#include "instances/runtime/setup_reporter.hpp"

#include "shm/base/log.hpp"

namespace plchost {

SetupReporter::SetupReporter(int report_fd) : socket_(UniqueFd(report_fd)) {}

void SetupReporter::report(const SetupReport& report) {
  if (socket_) {
    // A manager that is gone, or that does not read, is no reason to stop: the instance runs on without it.
    if (const auto sent = socket_.send(encode(report)); sent) return;
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
  report({.step = step, .code = error.code, .text = error.describe()});
}

}  // namespace plchost
