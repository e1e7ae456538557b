#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "api/cli/top/top_rows.hpp"

namespace plchost {

/// A key, as people press it.
struct TopKey {
  enum class Kind : std::uint8_t { sign, enter, escape, erase, up, down, page_up, page_down, home, end, tab };
  Kind kind = Kind::sign;
  char sign = 0;  ///< of Kind::sign
};

/// A line of the screen.
struct TopLine {
  enum class Look : std::uint8_t { plain, title, header, chosen, warning, bad };
  std::string text;
  Look look = Look::plain;
};

/// A command that its user has confirmed.
struct TopCommand {
  std::string host;
  std::string instance;
  std::int32_t operation = 0;  ///< plc_OPERATION_...
  std::string argument;
  std::string done;  ///< "line1 of cell1 is started"
};

/// The state that the keys have led to, and its drawing. It knows neither terminal nor DDS.
class TopView {
 public:
  explicit TopView(TrendStyle style) noexcept : style_(style) {}

  /// Tells what there is to see. The choice stays on the row that it is on.
  void show(const std::vector<HostLook>& hosts, const TopFigures& figures);
  /// `rows`: of the screen, for pages.
  void press(TopKey key, std::size_t rows);
  /// In the last line, until the next key.
  void say(std::string text) { said_ = std::move(text); }

  [[nodiscard]] bool ended() const noexcept { return ended_; }
  [[nodiscard]] bool paused() const noexcept { return paused_; }
  /// The instance that is looked into, as "host/instance"; empty: none.
  [[nodiscard]] const std::string& inside() const noexcept { return inside_; }
  /// A command that is to be given now, once.
  [[nodiscard]] std::optional<TopCommand> take_command();

  /// Exactly `height` lines of at most `width` characters.
  [[nodiscard]] std::vector<TopLine> draw(std::size_t width, std::size_t height) const;

 private:
  enum class Page : std::uint8_t { instances, tasks, cores };
  enum class Question : std::uint8_t { none, filter, scheduler, confirm };

  [[nodiscard]] TopTable table() const;
  void press_in_list(TopKey key, std::size_t rows);
  void press_in_filter(TopKey key);
  void press_scheduler(TopKey key);
  void press_confirm(TopKey key);
  void press_sign(char sign);
  void move(std::ptrdiff_t by);
  void turn_to(Page page);
  void sort_by_next(std::ptrdiff_t by);
  /// "Switch line1 of cell1 to CmpSchedule?", "line1 of cell1 has CmpSchedule".
  struct Words {
    std::string verb;
    std::string to = {};
    std::string done;
  };
  void ask(std::int32_t operation, const Words& words, std::string argument = {});
  void ask_for_scheduler();
  /// The instance of the chosen row: "host/instance".
  [[nodiscard]] std::string chosen_instance() const;
  [[nodiscard]] const HostLook* host_of(std::string_view instance) const;
  void keep_choice();

  void draw_head(std::vector<TopLine>& lines) const;
  void draw_rows(std::vector<TopLine>& lines, std::size_t width, std::size_t height) const;
  void draw_losses(std::vector<TopLine>& lines, std::size_t width, std::size_t height) const;
  void draw_help(std::vector<TopLine>& lines) const;
  [[nodiscard]] TopLine foot() const;

  TrendStyle style_;
  std::vector<HostLook> hosts_;
  TopFigures figures_;
  std::map<std::string, std::size_t> states_;  // how many instances are in each
  std::size_t instances_ = 0;
  TopTable shown_;  // sorted and filtered
  Page page_ = Page::instances;
  std::string inside_;
  std::string chosen_;  // its row's name
  std::size_t place_ = 0;
  std::string sort_;  // a field; empty: as they come
  bool descending_ = false;
  std::string filter_;
  Question question_ = Question::none;
  std::string question_text_;
  std::vector<std::string> schedulers_;
  std::optional<TopCommand> asked_;    // waits for its confirmation
  std::optional<TopCommand> command_;  // is confirmed
  std::string said_;
  bool help_ = false;
  bool paused_ = false;
  bool ended_ = false;
};

/// At most `width` characters of a UTF-8 text.
[[nodiscard]] std::string cut_to(std::string_view text, std::size_t width);

}  // namespace plchost
