#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "instances/runtime/memory/area_memory.hpp"
#include "instances/runtime/memory/area_plan.hpp"
#include "instances/runtime/memory/declared_area.hpp"
#include "instances/runtime/memory/output_registers.hpp"
#include "instances/runtime/memory/retain_keeper.hpp"
#include "instances/runtime/memory/safe_outputs.hpp"
#include "instances/runtime/memory/task_areas.hpp"
#include "instances/runtime/memory/task_cycle.hpp"
#include "instances/runtime/variables/force_list.hpp"
#include "schedulers/tasks/task_config.hpp"
#include "shm/base/result.hpp"
#include "shm/pages/outputs_page.hpp"
#include "shm/pool/pool_room.hpp"

namespace plchost {

/// The bytes of the whole area; empty: they are kept.
[[nodiscard]] std::vector<std::byte> safe_values(const AreaSettings& settings);

/// The memory areas of one application.
class Areas {
 public:
  /// The surroundings of the areas: the pool, the settings, the folder of the files.
  struct Environment {
    ObjectPool* pool = nullptr;  ///< null: check() looks at no pool; place() needs one
    std::string instance;
    std::string application;  ///< its name
    std::span<const AreaSettings> settings;
    RetainKeeper::Options retain;
    PoolRoom* room = nullptr;  ///< null: check() does not look whether new memories find a place
    std::span<const ForceSlot> forces = {};  ///< of each task; empty: nothing is ever forced
  };

  /// plc_declare_area: checks it and adds it to `areas`. The handle of another version's area is that of the
  /// placed one of this name. Control thread.
  [[nodiscard]] RTS_HANDLE declare(std::vector<DeclaredArea>& areas, const Plc_Area* area,
                                   RTS_RESULT& result) const;
  /// All that is placed, with the tasks that use it.
  [[nodiscard]] const std::vector<DeclaredArea>& declared() const noexcept { return declared_; }
  /// Tells another version of the application, which has declared the same areas, the addresses. Control
  /// thread, before its first cycle.
  void tell_addresses(const std::vector<DeclaredArea>& areas) const;
  /// Whether these areas, whose uses are complete, can be placed. Makes and changes nothing, and opens no
  /// device, so that an instance can have all of it meanwhile. Set-up.
  [[nodiscard]] static Result<void> check(const Environment& environment,
                                          std::span<const DeclaredArea> areas);
  /// Places the areas, with which check() has found no fault, fills them with retain values or with initial
  /// values, and tells the application the addresses. Then puts the exchange of inputs and outputs around the
  /// cycles of the tasks that use them, and the forces around the code of all. A text: remarks. After an
  /// error, and if these areas go without keep(), the pool has the memories that it had before, and the
  /// retain values are those of before. Once, after the application was loaded; set-up.
  [[nodiscard]] Result<std::string> place(const Environment& environment, std::vector<DeclaredArea> areas,
                                          std::span<TaskConfig> tasks);

  /// Nothing of the start can fail any more: the memories of place() stay, and retain areas are written.
  /// After an error: as without it. Once; set-up.
  [[nodiscard]] Result<void> keep();

  /// Writes the retain areas now, if no task is within a cycle. Control thread.
  void save() {
    if (keeper_) keeper_->save_soon();
  }
  /// The same at the end of the process, and waits for it.
  void finish() {
    if (keeper_) keeper_->finish();
  }

  /// The text about memories that were cut short since the last call; empty: none. Control thread.
  [[nodiscard]] std::vector<std::string> look_for_losses();
  /// Looks for signs of the firmware of inputs that shows some. Once it gives none, all readers are shown
  /// what it has left for that. The text about changes since the last call. Every 100 ms; control thread.
  [[nodiscard]] std::vector<std::string> watch_inputs();
  /// RetainKeeper::problem(). Control thread.
  [[nodiscard]] std::string retain_problem() const { return keeper_ ? keeper_->problem() : std::string(); }

  /// Of these areas, all that a terminal can see.
  [[nodiscard]] SafeOutputs& outputs() noexcept { return *safe_outputs_; }
  /// The end of the process: the outputs are safe. `settled`: no task is within a cycle, so nobody else has
  /// to put them there again. Control thread.
  void end_outputs(bool settled) noexcept;

  /// plc_area_address, plc_get_area_state. Any context.
  [[nodiscard]] void* address(RTS_HANDLE area) const noexcept;
  [[nodiscard]] RTS_RESULT state(RTS_HANDLE area, Plc_Area_State& state) const noexcept;

 private:
  /// The memory of a block of the plan, and what lies in it.
  struct Block {
    AreaMemory memory;
    std::unique_ptr<OutputImage> outputs;        ///< null: no image is published
    std::unique_ptr<OutputRegisters> registers;  ///< null: no outputs of a device
    std::optional<plc_image> inputs;             ///< nothing: no image is read
    bool inputs_silent = false;                  ///< told in the log
    std::vector<std::byte> initial;
    std::string source;  ///< the setting that placed it, and what it names
    bool loss_told = false;
  };
  /// Retain areas that tasks have in common.
  struct RetainShare {
    std::set<std::size_t> tasks;
    std::vector<std::size_t> areas;
  };
  /// A task's view of a block.
  template <class View>
  struct Of {
    template <class... Arguments>
    Of(std::size_t of_block, Arguments&&... arguments)
        : block(of_block), view(std::forward<Arguments>(arguments)...) {}
    std::size_t block;
    View view;
  };

  // areas_place.cpp
  [[nodiscard]] Result<void> make_blocks(const Environment& environment);
  [[nodiscard]] Result<void> make_memory(const Environment& environment, Block& block,
                                         const AreaBlock& planned);
  void make_image(Block& block, const AreaBlock& planned);
  // areas_outputs.cpp
  [[nodiscard]] Result<void> make_outputs_page(const Environment& environment);
  void make_registers(Block& block, const AreaBlock& planned);
  [[nodiscard]] std::vector<ByteRange> ranges_of(const AreaBlock& planned) const;
  [[nodiscard]] std::vector<ByteRange> written_alone(std::size_t index, std::size_t task) const;
  void make_safe_outputs();
  [[nodiscard]] Result<void> make_keeper(const Environment& environment);
  void tell_plain_addresses();
  void make_views(std::size_t index);
  void make_view(std::size_t index, std::size_t task, bool sole);
  [[nodiscard]] OutputView::Writes writes_of(std::size_t index, std::size_t task, bool image) const;
  [[nodiscard]] std::vector<std::size_t> users_of(std::size_t index) const;
  void tell_view(std::size_t index, std::size_t task, std::byte* bytes);
  void count_cycles(std::span<const TaskConfig> tasks);
  [[nodiscard]] std::vector<RetainShare> shares_of_retain() const;
  void wrap(std::span<TaskConfig> tasks, std::span<const ForceSlot> forces);
  [[nodiscard]] const DeclaredArea& first_of(const AreaBlock& planned) const {
    return declared_[planned.areas.front()];
  }
  [[nodiscard]] std::size_t task_number(const std::string& name) const;
  [[nodiscard]] std::size_t retain_number(std::size_t area) const noexcept;

  bool placed_ = false;
  std::vector<DeclaredArea> declared_;
  AreaPlan plan_;
  std::vector<std::string> tasks_;
  RetainLayout retain_;  // all retain areas
  std::deque<Block> blocks_;
  std::unique_ptr<RetainKeeper> keeper_;
  std::deque<Of<InputView>> inputs_;
  std::deque<Of<OutputView>> outputs_;
  std::vector<std::size_t> output_tasks_;  // of each of them
  std::optional<OutputsPage> outputs_page_;
  std::unique_ptr<SafeOutputs> safe_outputs_ = std::make_unique<SafeOutputs>();
  std::deque<TaskCycle> cycles_;   // of each task
  std::vector<std::byte*> plain_;  // addresses of areas that are the same for all
};

}  // namespace plchost
