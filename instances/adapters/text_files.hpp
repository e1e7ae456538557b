#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include <sys/types.h>

#include "shm/base/result.hpp"

namespace plchost {

/// Which file it is, however it is named.
struct FileIdentity {
  dev_t device = 0;
  ino_t number = 0;
  bool operator==(const FileIdentity&) const = default;
};

struct TextFile {
  std::string text;
  FileIdentity identity;
};

/// Reads a plain file. wrong_size: it has more than `most` bytes. All errors name the file.
[[nodiscard]] Result<TextFile> read_text_file(const std::string& path, std::size_t most);

/// Writes a new file. already_exists: there is something of that name, a link included. All errors name the
/// file. A file that cannot be written whole is removed.
[[nodiscard]] Result<void> write_new_file(const std::string& path, std::string_view text, mode_t mode = 0644);

}  // namespace plchost
