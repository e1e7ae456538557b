#pragma once

#include <functional>
#include <string>
#include <string_view>

#include "shm/base/result.hpp"
#include "shm/pages/instance_page.hpp"
#include "shm/sockets/control_message.hpp"

namespace plchost {

// The life of an application
// ==========================
//
//              loaded            start
//     none ───────────► stopped ───────────────────────► running
//                        ▲ │ ▲                              │
//                        │ │ └──────── stopping ◄───────────┤ stop
//             all ran    │ │ single       │    ▲            │
//                        │ ▼ cycle        │    │ stop       │
//                     single cycle ───────┼────┘            │
//                            │            │ a task does     │ fault
//                            │ fault      ▼ not come back   │
//                            └────────► exception ◄─────────┘
//
// A fault that is noticed in stopped leads from there to exception, too.
//
//   none          the instance has no application: it was given none, or is in safe mode
//   stopped       its tasks are parked, its variables keep their values
//   running       its tasks run under a scheduler
//   single cycle  each cyclic and freewheeling task runs one cycle, one after the other by priority, under no
//                 scheduler; event tasks rest
//   stopping      the tasks that drive outputs come to the end of their cycles, then the others
//   exception     a fault has stopped it. Tasks between cycles are parked, the variables are as
//                 they were, the process answers. There is no way out but a fresh process (reset, restart,
//                 load).
//
//                  none     stopped   running   single cycle  stopping  exception
//   start          refused  begins    refused   busy          busy      refused
//   stop           refused  refused   begins    begins        busy      nothing to do
//   single cycle   refused  begins    refused   busy          busy      refused
//   set scheduler  next     next      switches  busy          busy      refused
//
// "next": of the next start. "busy": try again when it is over. Commands that need a fresh process (reset,
// restart, load) are the manager's, in any state.
class ApplicationLife {
 public:
  using Record = std::function<void(ApplicationState from, ApplicationState to, std::string_view reason)>;

  /// `record` is told of each change.
  explicit ApplicationLife(Record record) : record_(std::move(record)) {}

  [[nodiscard]] ApplicationState state() const noexcept { return state_; }
  /// Why it is in exception; empty: it is not.
  [[nodiscard]] const std::string& problem() const noexcept { return problem_; }

  /// May this be done now? The text of a success, if there is one, says that there is nothing to do.
  /// wrong_state, busy: no; the text says what is possible. Verbs that are not in the table: always.
  [[nodiscard]] Result<std::string> admit(ControlVerb verb) const;

  /// Something has happened to the application that leaves it in its state.
  void stay(std::string_view reason) { record_(state_, state_, reason); }

  /// Goes there, if the picture above has an arrow. False: it has none; nothing has changed.
  bool go_to(ApplicationState to, std::string_view reason);

 private:
  Record record_;
  ApplicationState state_ = ApplicationState::none;
  std::string problem_;
};

}  // namespace plchost
