#include "tests/integration/storage/recording.hpp"

#include <cstring>
#include <fstream>
#include <iterator>

#include <fmt/format.h>

namespace plchost {

Result<std::vector<Change>> read_recording(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) return failure(ErrorCode::system, "cannot open " + path, errno);
  const std::string text(std::istreambuf_iterator<char>(file), {});
  std::vector<Change> changes;
  for (std::string_view rest = text; !rest.empty();) {
    ChangeHead head;
    if (rest.size() < sizeof head) return failure(ErrorCode::corrupt, path + " is cut off");
    std::memcpy(static_cast<void*>(&head), rest.data(), sizeof head);
    rest.remove_prefix(sizeof head);
    const std::size_t texts = std::size_t{head.path_bytes} + head.other_bytes;
    if (head.kind > ChangeKind::unknown || rest.size() < texts)
      return failure(ErrorCode::corrupt, path + " is no recording");
    changes.push_back({.kind = head.kind,
                       .inode = head.inode,
                       .number = head.number,
                       .path = std::string(rest.substr(0, head.path_bytes)),
                       .other = std::string(rest.substr(head.path_bytes, head.other_bytes))});
    rest.remove_prefix(texts);
  }
  return changes;
}

std::string describe(const Change& change) {
  switch (change.kind) {
    case ChangeKind::create:
      return "create " + change.path;
    case ChangeKind::make_folder:
      return "make folder " + change.path;
    case ChangeKind::write:
      return fmt::format("write {} bytes at {} of {}", change.other.size(), change.number, change.path);
    case ChangeKind::resize:
      return fmt::format("resize {} to {}", change.path, change.number);
    case ChangeKind::rename:
      return fmt::format("rename {} to {}", change.path, change.other);
    case ChangeKind::exchange:
      return fmt::format("exchange {} and {}", change.path, change.other);
    case ChangeKind::link:
      return fmt::format("link {} as {}", change.path, change.other);
    case ChangeKind::remove:
      return "remove " + change.path;
    case ChangeKind::remove_folder:
      return "remove folder " + change.path;
    case ChangeKind::sync_begin:
      return "begin to sync " + change.path;
    case ChangeKind::sync_end:
      return "sync " + change.path;
    case ChangeKind::mark:
      return fmt::format("mark '{}'", change.path);
    case ChangeKind::unknown:
      return fmt::format("'{}', which is not recorded", change.path);
  }
  return {};
}

}  // namespace plchost
