#include "shm/log/log.hpp"

#include <algorithm>
#include <cerrno>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <utility>

#include <poll.h>
#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/base_sink.h>
#include <unistd.h>

#include "shm/base/names.hpp"
#include "shm/log/log_line.hpp"

namespace plchost {

namespace {

// Standard error, which it never waits for: a line that finds a full pipe or socket is counted instead. No
// process stands still because nobody reads its log.
class ErrorStreamSink final : public spdlog::sinks::base_sink<std::mutex> {
 protected:
  void sink_it_(const spdlog::details::log_msg& message) override {
    if (lost_ > 0) tell_of_lost(message);
    spdlog::memory_buf_t line;
    formatter_->format(message, line);
    if (!write_all({line.data(), line.size()})) ++lost_;
  }
  void flush_() override {}

 private:
  void tell_of_lost(const spdlog::details::log_msg& next) {
    const std::string text = count_text(lost_, "line before this one was", "lines before this one were") +
                             " lost, because nobody read them";
    const spdlog::details::log_msg message(next.time, {}, next.logger_name, spdlog::level::warn, text);
    spdlog::memory_buf_t line;
    formatter_->format(message, line);
    if (write_all({line.data(), line.size()})) lost_ = 0;
  }

  static bool write_all(std::string_view text) noexcept {
    // So much fits into a pipe that takes anything.
    constexpr std::size_t kAtOnce = 4096;
    while (!text.empty()) {
      pollfd poll{.fd = STDERR_FILENO, .events = POLLOUT, .revents = 0};
      if (::poll(&poll, 1, 0) != 1 || (poll.revents & POLLOUT) == 0) return false;
      const ssize_t written = ::write(STDERR_FILENO, text.data(), std::min(text.size(), kAtOnce));
      if (written < 0 && errno == EINTR) continue;
      if (written <= 0) return false;
      text.remove_prefix(static_cast<std::size_t>(written));
    }
    return true;
  }

  std::uint64_t lost_ = 0;
};

// Texts of applications can hold anything: it must not be a line of its own, nor reach a terminal.
class PrintableText final : public spdlog::custom_flag_formatter {
 public:
  void format(const spdlog::details::log_msg& message, const std::tm& /*time*/,
              spdlog::memory_buf_t& line) override {
    std::string text(message.payload.data(), message.payload.size());
    std::ranges::replace_if(text, [](char c) { return c == '\n' || c == '\r' || c == '\t'; }, ' ');
    text = printable(std::move(text));
    line.append(text.data(), text.data() + text.size());
  }
  [[nodiscard]] std::unique_ptr<custom_flag_formatter> clone() const override {
    return std::make_unique<PrintableText>();
  }
};

}  // namespace

void set_log_pattern(const std::string& pattern) {
  auto formatter = std::make_unique<spdlog::pattern_formatter>();
  formatter->add_flag<PrintableText>('v').set_pattern(pattern);
  spdlog::default_logger()->set_formatter(std::move(formatter));
}

void start_log(const std::string& program, const std::string& level) {
  auto logger = std::make_shared<spdlog::logger>(program, std::make_shared<ErrorStreamSink>());
  logger->set_level(spdlog::level::from_str(level));
  spdlog::set_default_logger(std::move(logger));
  set_log_pattern(kLogPattern);
}

}  // namespace plchost
