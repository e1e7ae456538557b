#include "instances/io/modbus/client/device_claim.hpp"

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string_view>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <sys/types.h>
#include <sys/un.h>
#include <unistd.h>

#include "instances/io/modbus/config/endpoint.hpp"
#include "shm/base/names.hpp"
#include "shm/base/system_call.hpp"
#include "shm/log/log.hpp"

namespace plchost::modbus {

namespace {

constexpr int kLooks = 8;

// "process 4711 (plchost-modbus --config a.toml)"
std::string process_text(pid_t pid) {
  constexpr std::size_t kMost = 200;
  if (pid <= 0) return "another process";
  std::ifstream file(fmt::format("/proc/{}/cmdline", pid), std::ios::binary);
  std::string line{std::istreambuf_iterator<char>(file), {}};
  const std::size_t program = std::string_view(line.c_str()).rfind('/');
  if (program != std::string::npos) line.erase(0, program + 1);
  while (line.ends_with('\0')) line.pop_back();
  std::ranges::replace(line, '\0', ' ');
  return fmt::format("process {} ({})", pid, shortened(printable(std::move(line)), kMost));
}

// The process with an exclusive lock of the open file; 0: none is known.
pid_t holder_of(int fd) {
  struct stat status{};
  if (::fstat(fd, &status) != 0) return 0;
  const std::string file = fmt::format("{:02x}:{:02x}:{}", ::gnu_dev_major(status.st_dev),
                                       ::gnu_dev_minor(status.st_dev), status.st_ino);
  std::ifstream locks("/proc/locks");
  for (std::string line; std::getline(locks, line);) {
    std::istringstream words(line);  // "1: FLOCK  ADVISORY  WRITE 4711 00:18:5 0 EOF"
    std::string number;
    std::string kind;
    std::string way;
    std::string access;
    pid_t pid = 0;
    std::string held;
    if (words >> number >> kind >> way >> access >> pid >> held && kind == "FLOCK" && held == file)
      return pid;
  }
  return 0;
}

// A name that ends with its process, and leaves no file.
sockaddr_un claim_address(std::string_view name, socklen_t& size) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const std::size_t length = std::min(name.size(), sizeof address.sun_path - 1);
  name.copy(address.sun_path + 1, length);
  size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + length);
  return address;
}

Result<UniqueFd> local_socket() {
  UniqueFd fd(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (!fd) return failure(ErrorCode::system, "socket", errno);
  return fd;
}

}  // namespace

Result<UniqueFd> claim_line(const std::string& path) {
  UniqueFd fd(::open(path.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  if (!fd) return failure(ErrorCode::unavailable, path, errno);
  if (::flock(fd.get(), LOCK_EX | LOCK_NB) == 0) return fd;
  if (errno != EWOULDBLOCK) return failure(ErrorCode::unavailable, path, errno);
  const pid_t holder = holder_of(fd.get());
  if (holder == ::getpid()) {
    return failure(ErrorCode::busy,
                   fmt::format("{}: another device of this file has this line by another path; write it "
                               "alike for both",
                               path));
  }
  return failure(ErrorCode::busy,
                 fmt::format("{}: {} uses this line; end that one, or put all devices of the "
                             "line into one file",
                             path, process_text(holder)));
}

Result<UniqueFd> claim_outputs(const DeviceConfig& device) {
  const auto endpoint = parse_endpoint(device.tcp);
  if (!endpoint || device.writes.empty()) return UniqueFd();
  PLCHOST_TRY_ASSIGN(auto claim, local_socket());
  socklen_t size = 0;
  const sockaddr_un address =
      claim_address(fmt::format("plchost-modbus/{}/{}", endpoint->text(), int{device.unit}), size);
  const auto* const generic = reinterpret_cast<const sockaddr*>(&address);
  if (::bind(claim.get(), generic, size) == 0) {
    PLCHOST_TRY(check_errno(::listen(claim.get(), kLooks), "listen"));  // so that others see whose it is
    return claim;
  }
  if (errno != EADDRINUSE) return failure(ErrorCode::system, "bind", errno);
  PLCHOST_TRY_ASSIGN(const auto asking, local_socket());
  ucred holder{};
  socklen_t length = sizeof holder;
  const bool is_known = (::connect(asking.get(), generic, size) == 0 || errno == EAGAIN) &&
                        ::getsockopt(asking.get(), SOL_SOCKET, SO_PEERCRED, &holder, &length) == 0 &&
                        holder.pid > 0;
  // Any user may take any name. One who may not end this process may not keep it from its device either.
  if (is_known && holder.uid != 0 && holder.uid != ::geteuid()) {
    spdlog::warn("device '{}': {} of user {} says that it writes the outputs; nothing else is known of it",
                 device.name, process_text(holder.pid), holder.uid);
    return UniqueFd();
  }
  return failure(
      ErrorCode::busy,
      fmt::format("device '{}': {} writes the outputs of {} unit {}; end that one, or put all "
                  "maps of the device into one file",
                  device.name, process_text(is_known ? holder.pid : 0), endpoint->text(), int{device.unit}));
}

void end_looks(const UniqueFd& claim) noexcept {
  while (UniqueFd(::accept4(claim.get(), nullptr, nullptr, SOCK_CLOEXEC))) {
  }
}

}  // namespace plchost::modbus
