#include "instances/adapters/text_files.hpp"

#include <array>
#include <cerrno>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include "shm/base/unique_fd.hpp"

namespace plchost {

namespace {

auto cannot(std::string_view act, const std::string& path) {
  const int error = errno;
  const ErrorCode code = error == EEXIST   ? ErrorCode::already_exists
                         : error == ENOENT ? ErrorCode::not_found
                                           : ErrorCode::system;
  return failure(code, fmt::format("{} cannot be {}", path, act), error);
}

bool write_all(int fd, std::string_view text) {
  while (!text.empty()) {
    const ssize_t count = ::write(fd, text.data(), text.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return false;
    text.remove_prefix(static_cast<std::size_t>(count));
  }
  return true;
}

}  // namespace

Result<TextFile> read_text_file(const std::string& path, std::size_t most) {
  const UniqueFd fd(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY));
  struct stat status{};
  if (!fd || ::fstat(fd.get(), &status) != 0) return cannot("read", path);
  if (!S_ISREG(status.st_mode)) return failure(ErrorCode::wrong_type, path + " is not a plain file");
  TextFile file{.text = {}, .identity = {status.st_dev, status.st_ino}};
  std::array<char, 65536> piece{};
  for (;;) {
    const ssize_t count = ::read(fd.get(), piece.data(), piece.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return cannot("read", path);
    if (count == 0) return file;
    file.text.append(piece.data(), static_cast<std::size_t>(count));
    if (file.text.size() > most)
      return failure(ErrorCode::wrong_size, fmt::format("{} is larger than {} MiB", path, most >> 20));
  }
}

Result<void> write_new_file(const std::string& path, std::string_view text, mode_t mode) {
  UniqueFd fd(::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, mode));
  if (!fd) return cannot("written", path);
  // Some file systems tell only when it is closed that there was no room.
  if (write_all(fd.get(), text) && ::fsync(fd.get()) == 0 && ::close(fd.release()) == 0) return {};
  auto error = cannot("written", path);
  ::unlink(path.c_str());
  return error;
}

}  // namespace plchost
