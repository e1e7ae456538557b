#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "api/control/control_handler.hpp"
#include "manager/system/helper_process.hpp"
#include "manager/system/reactor.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// So long the check of a configuration may take: it tries all applications.
inline constexpr Duration kReloadLimit = std::chrono::seconds(60);
/// The most bytes of an answer; the room in an answer of the API.
inline constexpr std::size_t kMaxReloadText = 511;

/// Lines as one text of at most `most` bytes. If it would be longer, its last line counts those that are left
/// out, and `where` says where they are.
[[nodiscard]] std::string join_lines(const std::vector<std::string>& lines, std::string_view where,
                                     std::size_t most = kMaxReloadText);

/// Answers `reload host`, and does it for SIGHUP; passes all else on. A process of its own checks the file,
/// as the manager must not wait. Requests of that time get a round of their own: the file may be
/// another one by then.
class ConfigReload : public ControlHandler {
 public:
  struct Settings {
    std::string file;
    std::string program;   ///< plchostd
    std::string programs;  ///< its --programs
  };
  /// Takes over what is in the file and gives a line for each change; or says, line by line, why it is
  /// refused.
  using Apply = std::function<Result<std::vector<std::string>>()>;

  /// `next` outlives it.
  ConfigReload(Reactor& reactor, Settings settings, ControlHandler& next, Apply apply);

  void handle(const ControlRequest& request, ControlReplyFunction reply) override;
  /// The service manager asks for it, and is told.
  void reload_by_signal();
  /// The end of the manager: nothing is taken over any more, and those that wait are told so.
  void shut_down();

 private:
  struct Waiting {
    ControlRequest request;
    ControlReplyFunction reply;  // null: SIGHUP
  };
  void add(Waiting waiting);
  void begin();
  [[nodiscard]] Result<void> start_check();
  void check_ended(const HelperEnd& end);
  void finish(const Result<std::string>& result);
  [[nodiscard]] Result<std::string> take_over();

  Settings settings_;
  ControlHandler& next_;
  Apply apply_;
  HelperProcess check_;
  std::vector<Waiting> round_;  // of the check that runs
  std::vector<Waiting> later_;
  bool ending_ = false;
};

}  // namespace plchost
