#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "tests/integration/storage/disk_model.hpp"

namespace plchost {

/// Puts each state of a disk into a folder and has it read by the functions that a host reads it with. Each
/// file of a host has a rule there (manager/storage.md lists them): a file of which none is known is a
/// problem.
class DiskChecks {
 public:
  /// `folder`: for the states, which stand there in the place of `top`.
  DiskChecks(const DiskModel& model, std::string top, std::string folder);

  void look_at_all(FileSystem file_system);
  /// The faults that were found, each with the state in which it is there.
  [[nodiscard]] const std::vector<std::string>& problems() const noexcept { return problems_; }
  [[nodiscard]] std::size_t states() const noexcept { return states_; }
  /// Makes the folder as that state has it.
  void put(const FileTree& files);
  [[nodiscard]] const std::string& folder() const noexcept { return folder_; }

  static constexpr std::size_t kMostProblems = 20;

 private:
  void look_at(const CutDisk& disk);
  void look_at_file(const CutDisk& disk, const std::string& path);
  void look_at_retain(const CutDisk& disk, const std::string& path);
  void look_at_versions(const CutDisk& disk, const std::string& folder);
  void look_at_log(const CutDisk& disk, const std::string& folder);
  void wrong(const CutDisk& disk, const std::string& path, const std::string& what);
  [[nodiscard]] std::string at(const std::string& path) const;

  const DiskModel& model_;
  std::string top_;
  std::string folder_;
  std::map<std::string, std::shared_ptr<const std::string>> on_disk_;
  std::set<std::string> logs_seen_;  // by their contents and promises: most states differ in other files
  std::vector<std::string> problems_;
  std::size_t states_ = 0;
};

/// The paths below `top` that are not as the recording says: it misses a change. Empty: there are none.
[[nodiscard]] std::vector<std::string> unrecorded(const DiskModel& model, const std::string& top);

}  // namespace plchost
