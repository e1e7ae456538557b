#pragma once

#include <memory>
#include <optional>
#include <span>

#include "api/cli/top/top_view.hpp"
#include "shm/base/result.hpp"

namespace plchost {

/// The terminal, by ncurses. Its end, also by an exception, gives the terminal back as it was.
class TopScreen {
 public:
  /// `coloured`: rows by their state. unsupported: standard output or input is no terminal, or of a kind that
  /// is not known ($TERM).
  [[nodiscard]] static Result<std::unique_ptr<TopScreen>> open(bool coloured);
  TopScreen(const TopScreen&) = delete;
  TopScreen& operator=(const TopScreen&) = delete;
  ~TopScreen();

  [[nodiscard]] std::size_t width() const;
  [[nodiscard]] std::size_t height() const;
  /// Sends what has changed.
  void draw(std::span<const TopLine> lines);
  /// Waits for a key for so long. Nothing: none came, or the terminal has another size now.
  [[nodiscard]] std::optional<TopKey> key(Duration patience);
  /// Its other end was closed: no key will come any more.
  [[nodiscard]] bool is_gone() const noexcept { return is_gone_; }

 private:
  struct Terminal;
  explicit TopScreen(std::unique_ptr<Terminal> terminal) noexcept;
  std::unique_ptr<Terminal> terminal_;
  bool is_gone_ = false;
};

}  // namespace plchost
