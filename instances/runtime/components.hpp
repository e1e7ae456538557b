#pragma once

#include <string>
#include <vector>

#include "instances/runtime/shared_object.hpp"
#include "shm/base/result.hpp"

namespace plchost {

/// The components of [ComponentManager]: see plc_app.h for their hooks.
class Components {
 public:
  Components() = default;

  /// Loads all files and calls CH_INIT, CH_INIT2, CH_INIT3. If one refuses, those that were called get their
  /// CH_EXIT.. hooks. Control thread.
  [[nodiscard]] Result<void> load(const std::vector<std::string>& files);

  /// Calls CH_EXIT3, CH_EXIT2, CH_EXIT in reverse order, as far as the hooks of load() came. Once.
  void exit();

 private:
  [[nodiscard]] Result<void> call_all(unsigned hook);

  std::vector<SharedObject> objects_;
  unsigned reached_ = 0;  // the last CH_INIT.. hook that was called
};

}  // namespace plchost
