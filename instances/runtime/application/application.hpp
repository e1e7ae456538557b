#pragma once

#include <span>
#include <string>
#include <vector>

#include "instances/plc_app.h"
#include "instances/runtime/application/application_host.hpp"
#include "instances/runtime/application/shared_object.hpp"
#include "instances/runtime/tasks/task_builder.hpp"
#include "schedulers/tasks/task_config.hpp"
#include "shm/base/result.hpp"

namespace plchost {

struct DeclaredApplication;

/// The loaded program of the user.
class Application {
 public:
  /// Checks and loads the file, beside the application that runs if there is one, has its plc_app_init
  /// called, which declares itself to `host`, and checks the tasks with their options. Nothing of the
  /// declaration holds yet. The text says what is wrong with the file or with which task. Control thread.
  [[nodiscard]] static Result<DeclaredApplication> load(const std::string& path, ApplicationHost& host);

  /// The settings of its tasks: they win over the application's own.
  [[nodiscard]] Result<void> apply(std::span<const TaskSettings> settings) {
    return apply_task_settings(settings, tasks_);
  }

  /// Calls plc_app_exit, if it has one. Once, when its tasks have ended, or run the code of another version.
  void exit();

  /// The functions of its tasks, in their order: to be exchanged.
  [[nodiscard]] const TaskCodes& codes() const noexcept { return codes_; }
  /// The tasks, whose code was exchanged, are from now on those of `next`; that is then the version before.
  void exchange(Application& next) noexcept;
  /// Ends a version whose code no task runs. While another one runs on: its plc_app_exit, and it is unloaded.
  /// Else its plc_app_exit is left to ApplicationHost::end_refused(). Control thread.
  void leave(ApplicationHost& host);
  [[nodiscard]] bool contains(const void* address) const noexcept { return object_.contains(address); }

  [[nodiscard]] const std::string& path() const noexcept { return object_.path(); }
  /// How its file was built, as that was when it was loaded: see build_of().
  [[nodiscard]] const std::string& build() const noexcept { return build_; }
  [[nodiscard]] std::string name() const;
  /// The facts that the schedulers need. Their functions point into the application.
  [[nodiscard]] const std::vector<TaskConfig>& tasks() const noexcept { return tasks_; }
  /// For those that put something around the cycles. Before the tasks are made.
  [[nodiscard]] std::span<TaskConfig> tasks_to_change() noexcept { return tasks_; }
  [[nodiscard]] Task_Info& info(std::size_t index) const noexcept { return *codes_[index]->info; }

 private:
  Application(SharedObject object, std::string build, const sys_setup_tasks_struct& setup,
              std::vector<TaskConfig> tasks, TaskCodes codes)
      : object_(std::move(object)),
        build_(std::move(build)),
        setup_(&setup),
        tasks_(std::move(tasks)),
        codes_(std::move(codes)) {}
  [[nodiscard]] static Result<Application> built(SharedObject& object, std::string build,
                                                 const ApplicationDeclaration& declaration);

  SharedObject object_;
  std::string build_;                    // taken at once: another file may be put into its place
  const sys_setup_tasks_struct* setup_;  // in the application
  std::vector<TaskConfig> tasks_;
  TaskCodes codes_;  // in the order of tasks_
};

/// A program that is loaded, and what it has said of itself, of which nothing holds before a commit.
struct DeclaredApplication {
  Application application;
  ApplicationDeclaration declaration;
};

}  // namespace plchost
