#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "instances/runtime/application/application.hpp"
#include "instances/runtime/application/application_declaration.hpp"
#include "instances/runtime/application/application_host.hpp"
#include "instances/runtime/application/declare_application.hpp"
#include "shm/base/result.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// Another version of the application that runs, loaded beside it and ready to take over. Control thread.
class OnlineChange {
 public:
  /// So long may the new version's set-up take. The manager waits longer.
  static constexpr Duration kLongestSetup = std::chrono::seconds(8);

  /// Loads it, has its plc_app_init called, and compares it with what runs, of which nothing is changed.
  /// refused: it cannot take over; the text lists the reasons. timed_out: its set-up took too long. Else: the
  /// fault of the file.
  [[nodiscard]] static Result<std::unique_ptr<OnlineChange>> prepare(const std::string& path,
                                                                     const LoadContext& context,
                                                                     Application& running);
  /// Without take_over() the new version ends, and nothing is left of it.
  ~OnlineChange();
  OnlineChange(const OnlineChange&) = delete;
  OnlineChange& operator=(const OnlineChange&) = delete;

  /// Copies the variables and gives the tasks the new functions. Once, while no task is in a cycle and no
  /// event variable is read; as long as the copying takes.
  void take_over() noexcept;
  /// The rest of the work: callbacks, registrations, and the end of the version before. The callbacks for
  /// external-event tasks are `notify`'s.
  void finish(const std::function<void()>& notify);

  [[nodiscard]] const std::string& path() const noexcept { return next_.path(); }
  /// "2 areas, variables machine, recipe (312 bytes)": for the operator.
  [[nodiscard]] std::string describe() const;

 private:
  OnlineChange(Application& running, Application next, ApplicationHost& host)
      : running_(running), next_(std::move(next)), host_(host) {}
  [[nodiscard]] Result<void> compare(const ApplicationDeclaration& declaration) const;
  void connect();

  struct Copy {
    void* to;
    const void* from;
    std::size_t bytes;
  };

  Application& running_;
  Application next_;
  ApplicationHost& host_;
  std::optional<Commit> commit_;   // nothing: not prepared yet
  TaskCodes codes_;                // of next_, in the order of running_'s tasks
  std::vector<Task_Info*> infos_;  // the same
  std::vector<Copy> copies_;
  std::vector<std::string> copied_;  // names
  VariableService::Next variables_;  // seen from outside
};

}  // namespace plchost
