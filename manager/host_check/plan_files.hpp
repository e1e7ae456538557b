#pragma once

#include <cstdint>
#include <string>
#include <utility>

#include "manager/host_check/host_plan.hpp"
#include "shm/base/result.hpp"
#include "shm/base/unique_fd.hpp"

namespace plchost {

/// The files of plans below a root: that of the host, or the folder of an image. No symbolic link is followed
/// on the way to them, so none leads out of the image. Set-up.
class PlanFiles {
 public:
  enum class State : std::uint8_t {
    missing,
    same,
    other,  ///< made by plchost, with another text, of another form or of another owner
  };

  /// `root`: empty, or a folder.
  explicit PlanFiles(std::string root) : root_(std::move(root)) {}

  /// refused: it was not made by plchost, or the way to it is a symbolic link. system: it cannot be read.
  [[nodiscard]] Result<State> state(const PlannedFile& file) const;
  /// All or nothing, also after a loss of power. It replaces any file that is there: look at its state first.
  /// Missing folders are made.
  [[nodiscard]] Result<void> write(const PlannedFile& file) const;
  /// Removes the file of plchost at that place, and the left-over of a write that was cut. False: none was
  /// there. refused, system: as state().
  [[nodiscard]] Result<bool> remove(PlanPart part) const;

 private:
  struct Way {
    UniqueFd above = {};  ///< the folder that the folder is in
    std::string folder_name = {};
    UniqueFd folder = {};  ///< empty: it is not there
    std::string name = {};
    std::string shown = {};  ///< for errors
  };
  [[nodiscard]] Result<Way> way_to(PlanPart part, bool make) const;
  [[nodiscard]] Result<State> look(const Way& way, const PlannedFile& file) const;

  std::string root_;
};

}  // namespace plchost
