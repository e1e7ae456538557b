#include "api/cli/own_file.hpp"

#include <cerrno>
#include <cstdio>
#include <cstdlib>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include "shm/base/names.hpp"
#include "shm/base/system_call.hpp"

namespace plchost {

Result<OwnFile> OwnFile::create(std::string path) {
  struct stat status{};
  if (::lstat(path.c_str(), &status) == 0 && !S_ISREG(status.st_mode)) {
    return failure(
        ErrorCode::wrong_type,
        fmt::format("{} is no plain file: name a plain file, or one that is not there", printable(path)));
  }
  std::string fresh = path + ".XXXXXX";
  UniqueFd fd(::mkostemp(fresh.data(), O_CLOEXEC));  // for its owner only
  if (!fd)
    return failure(ErrorCode::system, fmt::format("cannot make a file beside {}", printable(path)), errno);
  return OwnFile(std::move(path), std::move(fresh), std::move(fd));
}

OwnFile::~OwnFile() {
  if (!fresh_.empty()) ::unlink(fresh_.c_str());
}

Result<void> OwnFile::write(std::string_view bytes) {
  while (!bytes.empty()) {
    PLCHOST_TRY_ASSIGN(const auto written, check_errno(::write(fd_.get(), bytes.data(), bytes.size()),
                                                       "cannot write " + printable(path_)));
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  return {};
}

Result<void> OwnFile::put_in_place() {
  PLCHOST_TRY(check_errno(::fsync(fd_.get()), "cannot sync " + printable(path_)));
  if (::rename(fresh_.c_str(), path_.c_str()) != 0)
    return failure(ErrorCode::system, fmt::format("cannot replace {}", printable(path_)), errno);
  fresh_.clear();
  return {};
}

}  // namespace plchost
