#include "shm/files/kernel_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include "shm/base/system_call.hpp"
#include "shm/base/unique_fd.hpp"

namespace plchost {

Result<void> write_kernel_file(const std::string& path, std::string_view text) {
  const UniqueFd file(::open(path.c_str(), O_WRONLY | O_CLOEXEC));
  PLCHOST_TRY(check_errno(file.get(), "cannot open " + path));
  PLCHOST_TRY(check_errno(::write(file.get(), text.data(), text.size()),
                          fmt::format("cannot write \"{}\" into {}", text, path)));
  return {};
}

}  // namespace plchost
