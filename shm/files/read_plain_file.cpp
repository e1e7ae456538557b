#include "shm/files/read_plain_file.hpp"

#include <cerrno>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include "shm/base/system_call.hpp"
#include "shm/base/unique_fd.hpp"

namespace plchost {

namespace {

// A link, and a socket.
bool is_no_plain_file(int error) noexcept {
  return error == ELOOP || error == ENXIO;
}

ErrorCode code_of_read(int error) noexcept {
  if (error == ENOENT || error == ENOTDIR) return ErrorCode::not_found;
  return is_no_plain_file(error) ? ErrorCode::wrong_type : ErrorCode::system;
}

}  // namespace

Result<std::string> read_plain_file(const std::string& path, std::size_t most) {
  // O_NONBLOCK: a FIFO would make the open wait.
  const UniqueFd fd(::open(path.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC));
  if (!fd) {
    const int error = errno;
    return failure(code_of_read(error), "cannot open " + path, error);
  }
  struct stat status{};
  PLCHOST_TRY(check_errno(::fstat(fd.get(), &status), "cannot examine " + path));
  // Without a name: it was replaced meanwhile.
  if (!S_ISREG(status.st_mode) || status.st_nlink > 1)
    return failure(ErrorCode::wrong_type, path + " is no plain file of one name");
  const auto size = static_cast<std::size_t>(status.st_size);
  if (size > most)
    return failure(ErrorCode::corrupt,
                   fmt::format("{} has {} bytes; allowed are up to {}", path, size, most));
  std::string text(size, '\0');
  std::size_t length = 0;
  while (length < size) {
    PLCHOST_TRY_ASSIGN(const auto got, check_errno(::read(fd.get(), text.data() + length, size - length),
                                                   "cannot read " + path));
    if (got == 0) break;
    length += static_cast<std::size_t>(got);
  }
  text.resize(length);
  return text;
}

}  // namespace plchost
