#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "shm/base/result.hpp"
#include "tests/integration/storage/recording.hpp"

namespace plchost {

/// How much a file system promises beside what was synced.
enum class FileSystem : std::uint8_t {
  /// As ext4 with data=ordered, XFS and btrfs: names change in their order, and a sync of anything takes all
  /// names before it along. Bytes of a file come in their order, in blocks of 4096, and as late as they like:
  /// a file that has its new name may be empty.
  ordered,
  /// Not more than POSIX promises: of what was not synced any part may be there. A sync of a file is one of
  /// its bytes, not of its name. Bytes come in sectors of 512; those that are missing are zero, or the file
  /// ends before them.
  weak
};
[[nodiscard]] std::string_view to_string(FileSystem file_system) noexcept;

/// All below a folder: the contents of files; folders have none.
using FileTree = std::map<std::string, std::shared_ptr<const std::string>>;

/// One state in which a power cut may leave a disk.
struct CutDisk {
  FileSystem file_system = FileSystem::ordered;
  std::size_t cut = 0;  ///< so many changes had been begun
  std::string told;     ///< where it was cut, and what was lost; for people
  FileTree files;
};

/// All that a recording says about the disk under the processes.
class DiskModel {
 public:
  /// `top`: the folder that was recorded. It was empty, and is on the disk. Changes of files whose paths have
  /// the text `kUnimportant` are in each state: nobody counts on them after a power cut. corrupt: something
  /// was changed that is not recorded.
  static constexpr std::string_view kUnimportant = "/under_way/";
  [[nodiscard]] static Result<DiskModel> make(std::vector<Change> changes, const std::string& top);

  /// Calls `check` for each state, each one once for each mark that is set by then.
  void for_each_cut(FileSystem file_system, const std::function<void(const CutDisk& disk)>& check) const;

  /// As processes see it after so many changes.
  [[nodiscard]] FileTree live(std::size_t changes) const;
  [[nodiscard]] const std::vector<Change>& all_changes() const noexcept { return changes_; }
  [[nodiscard]] std::size_t changes() const noexcept { return changes_.size(); }
  /// The place of the last mark before `cut` that says that `path` is on the disk as it is there: "kept all",
  /// or "kept" with a part of the path. 0: there is none.
  [[nodiscard]] std::size_t promised(std::string_view path, std::size_t cut) const;
  /// The contents that processes saw after so many changes; null: no such file.
  [[nodiscard]] std::shared_ptr<const std::string> seen(const std::string& path, std::size_t changes) const;
  /// Processes saw these contents of `path`, null: no such file, at some time from `first` to `cut`.
  [[nodiscard]] bool was_seen(const std::string& path, const std::shared_ptr<const std::string>& contents,
                              std::size_t first, std::size_t cut) const;
  /// All that a file ever had.
  [[nodiscard]] std::set<std::string> paths() const;

 private:
  using Id = std::size_t;
  using Bytes = std::shared_ptr<const std::string>;
  static constexpr std::size_t kNever = std::numeric_limits<std::size_t>::max();
  static constexpr Id kTop = 0;

  struct Step {
    std::size_t index = 0;  // of the change
    ChangeKind kind = ChangeKind::mark;
    Id of = kTop;     // the folder whose names change, or the file
    Id to = kTop;     // the folder of the new name
    Id what = kTop;   // that has the name
    Id other = kTop;  // that has the new name before an exchange
    std::string name;
    std::string new_name;
    std::size_t synced = kNever;  // its own sync has ended with this change
    std::size_t any_sync = kNever;
    bool never_lost = false;  // no state is without it
    [[nodiscard]] static bool has_two_names(ChangeKind kind) {
      return kind == ChangeKind::rename || kind == ChangeKind::link || kind == ChangeKind::exchange;
    }
    [[nodiscard]] bool is_of_bytes() const { return kind == ChangeKind::write || kind == ChangeKind::resize; }
  };
  /// How much of a step is on the disk.
  struct Part {
    enum class Kind : std::uint8_t { all, none, size, first, last, some } kind = Kind::all;
    std::size_t amount = 0;
  };
  using Choice = std::vector<Part>;  // of each step
  struct Nodes {
    std::map<Id, std::map<std::string, Id>> folders{{kTop, {}}};
    std::map<Id, std::vector<std::pair<std::size_t, Part>>> files;  // by the steps that made them
  };
  struct Sight {
    std::size_t since = 0;
    Bytes contents;
  };

  Result<void> add(std::size_t index);
  Result<void> add_name(Step step, const Change& change);
  [[nodiscard]] std::optional<std::pair<Id, std::string>> place(std::string_view path) const;
  void find_syncs();
  void find_sights();
  void apply(std::size_t step, const Part& part, Nodes& nodes) const;
  [[nodiscard]] Bytes bytes_of(const std::vector<std::pair<std::size_t, Part>>& parts) const;
  void list(const Nodes& nodes, Id folder, const std::string& path, FileTree& tree) const;
  [[nodiscard]] FileTree build(const Choice& choice) const;
  [[nodiscard]] std::vector<Choice> choices(FileSystem file_system, std::size_t cut) const;
  [[nodiscard]] std::vector<Part> parts_of(FileSystem file_system, const Step& step) const;
  void choose_in_order(const Choice& known, std::size_t cut, std::vector<Choice>& all) const;
  void choose_freely(const Choice& known, std::size_t cut, std::vector<Choice>& all) const;
  [[nodiscard]] std::string tell(FileSystem file_system, std::size_t cut, const Choice& choice) const;

  std::vector<Change> changes_;
  std::string top_;
  std::vector<Step> steps_;
  std::map<std::uint64_t, Id> known_;  // by inode, which a later file may have again
  Id last_ = kTop;
  Nodes now_;
  std::map<std::string, std::vector<Sight>> sights_;
  mutable std::map<std::string, Bytes> made_;      // by the steps
  mutable std::map<std::string, Bytes> contents_;  // the same contents have one pointer
};

}  // namespace plchost
