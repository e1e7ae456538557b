#include <memory>
#include <optional>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "api/cli/cli_session.hpp"
#include "api/cli/interrupt.hpp"
#include "api/cli/terminal.hpp"
#include "api/cli/top/top_screen.hpp"
#include "api/cli/top/top_view.hpp"
#include "api/cli/verbs/host_commands.hpp"
#include "shm/base/names.hpp"

namespace plchost {

namespace {

constexpr Duration kPlantLook = std::chrono::milliseconds(100);  // time that a look at all hosts may take
constexpr Duration kKeyPatience = std::chrono::milliseconds(50);
constexpr std::size_t kTrendWidth = 20;

/// One run of plcctl top: it looks, draws and obeys, all on one thread. A command goes on while it does.
class Top {
 public:
  Top(CliSession& session, ControlClient& client, TopScreen& screen, double every_s)
      : session_(session),
        client_(client),
        screen_(screen),
        plant_(client),
        view_({.width = kTrendWidth, .unicode = terminal_style().unicode}),
        every_(std::chrono::duration_cast<Duration>(std::chrono::duration<double>(every_s))) {}

  void run() {
    while (!view_.ended() && !screen_.is_gone() && !interrupted()) {
      const TimePoint now = MonotonicClock::now();
      if (now >= next_ && !view_.paused()) look(now);
      client_.wait_for_change(MonotonicClock::now());  // takes what has come, for the command, too
      end_command();
      draw();
      if (const auto key = screen_.key(kKeyPatience)) {
        is_stale_ = true;
        view_.press(*key, screen_.height() / 2);
        // The instance that is looked into now has figures of its own, at once.
        if (view_.inside() != inside_) next_ = {};
      }
      begin_command();
    }
  }

 private:
  void look(TimePoint now) {
    if (auto hosts = session_.known_hosts()) {
      plant_.take(*std::move(hosts), now + kPlantLook);
    } else {
      view_.say(printable(hosts.error().describe()));
    }
    figures_.take(plant_.hosts(), now);
    inside_ = view_.inside();
    if (const std::size_t slash = inside_.find('/'); slash != std::string::npos) {
      figures_.take(plant_.statistics(inside_.substr(0, slash), inside_.substr(slash + 1)));
    }
    view_.show(plant_.hosts(), figures_);
    is_stale_ = true;
    next_ = now + every_;
  }

  void draw() {
    const std::pair size(screen_.width(), screen_.height());
    if (!std::exchange(is_stale_, false) && size == drawn_) return;
    drawn_ = size;
    screen_.draw(view_.draw(size.first, size.second));
  }

  void begin_command() {
    auto command = view_.take_command();
    if (!command) return;
    if (call_) return view_.say("the command before is still under way");
    done_ = command->done;
    const ApiRequest request = {.host = command->host,
                                .operation = command->operation,
                                .instance = command->instance,
                                .argument = command->argument};
    call_ = client_.core().call(request, session_.deadline(wait_for(command->operation)));
    call_->start();
    view_.say("...");
  }

  void end_command() {
    if (!call_ || !call_->done()) return;
    const auto reply = call_->take();
    call_.reset();
    is_stale_ = true;
    next_ = {};
    if (!reply) return view_.say(printable(reply.error().describe()));
    if (reply->code != ErrorCode::ok) return view_.say(printable(reply->text));
    view_.say(done_);
  }

  CliSession& session_;
  ControlClient& client_;
  TopScreen& screen_;
  PlantLook plant_;
  TopFigures figures_;
  TopView view_;
  Duration every_;
  TimePoint next_{};
  bool is_stale_ = true;                       // the screen shows something else
  std::pair<std::size_t, std::size_t> drawn_;  // of that size
  std::string inside_;
  std::optional<Async<Result<ApiReply>>> call_;
  std::string done_;
};

int top(CliSession& session, double every_s) {
  // An error of the connection is told before the screen is taken.
  const auto client = session.client();
  if (!client) return CliSession::fail(client.error());
  if (const auto hosts = session.shown_hosts(); !hosts) return CliSession::fail(hosts.error());
  const auto screen = TopScreen::open(shows_colours());
  if (!screen) {
    CliSession::fail(screen.error());
    return kExitUsage;
  }
  catch_interrupts();
  Top(session, **client, **screen, every_s).run();
  return kExitDone;
}

}  // namespace

void add_top_verb(const Command& plcctl, CliSession& session) {
  const auto every_s = std::make_shared<double>(1.0);
  constexpr double kLeast = 0.2;
  constexpr double kMost = 60;
  plcctl
      .noun("top", "See instances, tasks and cores on a full screen, and start, stop and switch them",
            [&session, every_s] { return top(session, *every_s); })
      .option("--interval", *every_s, "seconds between two looks (default 1)", kLeast, kMost);
}

}  // namespace plchost
