#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "shm/base/result.hpp"

namespace plchost {

/// The changes that processes make to files, in the order in which they were made: recorder.cpp writes them.
enum class ChangeKind : std::uint32_t {
  create,         ///< `path`: a file of that name, empty
  make_folder,    ///< `path`
  write,          ///< `other`: bytes at `number`
  resize,         ///< to `number` bytes
  rename,         ///< `path` to `other`
  exchange,       ///< `path` and `other`
  link,           ///< `path` is called `other` as well
  remove,         ///< `path`: a file
  remove_folder,  ///< `path`
  sync_begin,     ///< all that was changed before is on its way to the disk; `number`: which sync
  sync_end,       ///< and is there
  mark,           ///< `path`: the words of the test
  unknown         ///< `path`: something that is not recorded
};

/// How it lies in the recording, followed by `path` and `other`.
struct ChangeHead {
  ChangeKind kind = ChangeKind::mark;
  std::uint32_t process = 0;
  std::uint64_t inode = 0;
  std::uint64_t number = 0;
  std::uint32_t path_bytes = 0;
  std::uint32_t other_bytes = 0;
};

struct Change {
  ChangeKind kind = ChangeKind::mark;
  std::uint64_t inode = 0;  ///< that is made, changed or synced
  std::uint64_t number = 0;
  std::string path;
  std::string other;
};

/// system: it cannot be read. corrupt: it is none.
[[nodiscard]] Result<std::vector<Change>> read_recording(const std::string& path);
/// For people.
[[nodiscard]] std::string describe(const Change& change);

}  // namespace plchost
