#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "shm/base/result.hpp"
#include "shm/plc_obj_tab.h"
#include "shm/pool/object_pool.hpp"

/// The target of a SEM_ID of the seed's table: the table's own guard, or an object of the pool.
struct plc_sem {
  std::variant<std::recursive_timed_mutex*, plchost::SharedSemaphore, plchost::SharedMutex,
               plchost::SharedEvent>
      object;
  std::uint64_t cursor = 0;  ///< event: posts that were taken
};

namespace plchost {

/// The seed's table as this process sees the pool: see shm/plc_obj_tab.h.
class ObjTab {
 public:
  /// The one table of this process; made by the first call that finds the pool, and anew in a child of
  /// fork().
  [[nodiscard]] static Result<ObjTab*> of_this_process();

  /// Brings it up to date, unless the calling thread holds its guard or the pool cannot be listed now; an
  /// error only if it never could.
  [[nodiscard]] Result<objTab_t*> look();

 private:
  /// One object, opened.
  struct Row {
    std::string name;
    ObjectType type{};
    objTabType_t as{};
    SharedMemory memory{};
    std::unique_ptr<plc_sem> semaphore{};
  };

  explicit ObjTab(ObjectPool pool);
  [[nodiscard]] Result<void> refresh();
  [[nodiscard]] static objEntry_t entry_of(Row& row) noexcept;

  ObjectPool pool_;
  std::recursive_timed_mutex guard_;
  plc_sem guard_handle_;
  std::vector<std::unique_ptr<Row>> rows_;
  std::vector<objEntry_t> entries_;
  objTab_t table_{};
  std::uint64_t seen_ = 0;
  bool listed_ = false;
};

}  // namespace plchost
