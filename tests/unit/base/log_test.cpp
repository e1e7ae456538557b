#include "shm/log/log.hpp"

#include <algorithm>
#include <array>
#include <string>

#include <fcntl.h>
#include <gmock/gmock.h>
#include <unistd.h>

#include "shm/base/unique_fd.hpp"

namespace plchost {
namespace {

// Standard error is a pipe that nobody reads while this lives.
class UnreadErrors {
 public:
  UnreadErrors() : saved_(::dup(STDERR_FILENO)) {
    std::array<int, 2> fds{};
    EXPECT_EQ(::pipe2(fds.data(), O_CLOEXEC), 0);
    read_end_ = UniqueFd(fds[0]);
    const UniqueFd write_end(fds[1]);
    EXPECT_EQ(::fcntl(read_end_.get(), F_SETFL, O_NONBLOCK), 0);  // NOLINT: variadic
    EXPECT_EQ(::dup2(write_end.get(), STDERR_FILENO), STDERR_FILENO);
  }
  UnreadErrors(const UnreadErrors&) = delete;
  UnreadErrors& operator=(const UnreadErrors&) = delete;
  ~UnreadErrors() { ::dup2(saved_.get(), STDERR_FILENO); }

  [[nodiscard]] std::string read() const {
    std::string text;
    std::array<char, 4096> part{};
    for (;;) {
      const ssize_t got = ::read(read_end_.get(), part.data(), part.size());
      if (got <= 0) return text;
      text.append(part.data(), static_cast<std::size_t>(got));
    }
  }

 private:
  UniqueFd saved_;
  UniqueFd read_end_;
};

TEST(Log, NeverWaitsForItsReaderAndCountsWhatWasLost) {
  std::string first;
  std::string second;
  constexpr std::ptrdiff_t kLines = 10'000;
  {
    const UnreadErrors errors;
    start_log("log_test");
    for (std::ptrdiff_t i = 0; i < kLines; ++i) spdlog::info("line {}", i);
    first = errors.read();
    spdlog::warn("after");
    second = errors.read();
  }
  const std::ptrdiff_t seen = std::ranges::count(first, '\n');
  EXPECT_GT(seen, 100);
  EXPECT_LT(seen, kLines);
  EXPECT_THAT(first, testing::HasSubstr(" info log_test: line 0\n"));
  EXPECT_THAT(second, testing::HasSubstr(fmt::format("warning log_test: {} lines before this one were lost",
                                                     kLines - seen)));
  EXPECT_THAT(second, testing::EndsWith("warning log_test: after\n"));
}

TEST(Log, HasOneLineOfPrintableTextForWhateverWasLogged) {
  std::string text;
  {
    const UnreadErrors errors;
    start_log("log_test");
    set_log_pattern("%l: %v");
    spdlog::info("{}", "\x1b[31mred\n2026-11-22 error plchostd: forged\xff");
    spdlog::info("{}", "Förderband: {} %s");
    text = errors.read();
  }
  EXPECT_EQ(text, "info: ?[31mred 2026-11-22 error plchostd: forged?\ninfo: Förderband: {} %s\n");
}

}  // namespace
}  // namespace plchost
