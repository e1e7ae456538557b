#pragma once

#include <string>
#include <vector>

#include "instances/runtime/application/shared_object.hpp"
#include "shm/base/result.hpp"

namespace plchost {

/// The components of [ComponentManager]: see plc_app.h for their hooks.
class Components {
 public:
  Components() = default;

  /// Loads all files, without a call of their hooks. Control thread.
  [[nodiscard]] Result<void> load(const std::vector<std::string>& files);

  /// The first component's symbol of this name; null if none has it.
  [[nodiscard]] void* find(const char* symbol) const noexcept;

  /// Calls CH_INIT, CH_INIT2, CH_INIT3. If one refuses, those that were called get their CH_EXIT.. hooks.
  /// Control thread.
  [[nodiscard]] Result<void> init();

  /// Calls CH_TRIAL alone. Control thread.
  [[nodiscard]] Result<void> check();

  /// Calls CH_EXIT3, CH_EXIT2, CH_EXIT in reverse order, as far as the hooks of init() came. Once.
  void exit();

 private:
  struct InitHook {
    unsigned number;
    const char* name;
  };
  [[nodiscard]] Result<void> call_all(const InitHook& hook) const;

  std::vector<SharedObject> objects_;
  unsigned reached_ = 0;  // the last CH_INIT.. hook that was called
};

}  // namespace plchost
