#pragma once

#include <cstddef>
#include <cstdint>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "shm/base/time.hpp"

namespace plchost {

/// One line for each host that a file is sent to, on standard error if that is a terminal, else nothing. The
/// lines are gone when this is: the results are printed elsewhere. Any thread.
class ProgressBoard {
 public:
  ProgressBoard(const std::vector<std::string>& hosts, std::uint64_t size);
  ProgressBoard(const ProgressBoard&) = delete;
  ProgressBoard& operator=(const ProgressBoard&) = delete;
  ~ProgressBoard();

  /// So many bytes have arrived at that host.
  void show(std::string_view host, std::uint64_t received);
  /// It has answered.
  void end(std::string_view host);

 private:
  struct Line {
    std::string host;
    std::uint64_t received = 0;
    bool ended = false;
  };
  void draw();
  void clear();

  static constexpr Duration kPeriod = std::chrono::milliseconds(100);
  std::mutex mutex_;
  std::vector<Line> lines_;
  std::uint64_t size_;
  std::size_t drawn_ = 0;  // lines on the screen
  TimePoint next_{};
  bool terminal_;
};

/// "line1  [#####     ]  50 %  1.2 of 2.4 MiB"; `width`: of the name.
[[nodiscard]] std::string progress_line(std::string_view name, std::size_t width, std::uint64_t received,
                                        std::uint64_t size);

}  // namespace plchost
