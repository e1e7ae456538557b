#include "instances/io/modbus/client/device_claim.hpp"

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string_view>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <sys/types.h>
#include <unistd.h>

#include "instances/io/modbus/config/endpoint.hpp"
#include "shm/base/names.hpp"

namespace plchost::modbus {

namespace {

constexpr std::uint32_t kClaimBytes = 1;  // of the image, which stays empty

// "process 4711 (plchost-modbus --config a.toml)"
std::string process_text(pid_t pid) {
  constexpr std::size_t kMost = 200;
  if (pid <= 0) return "another process";
  std::ifstream file(fmt::format("/proc/{}/cmdline", pid), std::ios::binary);
  std::string line{std::istreambuf_iterator<char>(file), {}};
  const std::size_t program = line.rfind('/', line.find('\0'));  // not those of its arguments
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

void OutputsClaim::Close::operator()(plc_image* image) const noexcept {
  plc_image_close(image);
  delete image;
}

Result<OutputsClaim> OutputsClaim::take(const std::string& pool, const DeviceConfig& device) {
  const auto endpoint = parse_endpoint(device.tcp);
  const std::string address =
      fmt::format("{}/{}", endpoint ? endpoint->text() : device.tcp, int{device.unit});
  OutputsClaim claim(pool, device.name, address);
  PLCHOST_TRY(claim.open());
  return claim;
}

Result<void> OutputsClaim::open() {
  const std::string name = "modbus/" + address_;
  std::unique_ptr<plc_image, Close> image(new plc_image{});
  const int error = plc_image_open(pool_.c_str(), name.c_str(), kClaimBytes, PLC_IMAGE_WRITE, image.get());
  if (error == 0) {
    image_ = std::move(image);
    return {};
  }
  if (error != EBUSY) {
    return failure(ErrorCode::system,
                   fmt::format("the claim '{}' of device '{}' in pool '{}'", name, device_, pool_), error);
  }
  const bool is_known =
      plc_image_open(pool_.c_str(), name.c_str(), kClaimBytes, PLC_IMAGE_READ, image.get()) == 0;
  const pid_t holder = is_known ? holder_of(image->descriptor) : 0;
  return failure(ErrorCode::busy,
                 fmt::format("device '{}': {} writes the outputs of {}; end that one, or put all maps of the "
                             "device into one file",
                             device_, process_text(holder), address_));
}

Result<void> OutputsClaim::repair() {
  const std::string name = "modbus/" + address_;
  if (plc_image_gone(image_.get(), pool_.c_str(), name.c_str()) == 0) return {};
  const int held = image_->descriptor;
  (void)::flock(held, LOCK_UN);  // it may be the same file, cut short
  auto opened = open();
  if (!opened) (void)::flock(held, LOCK_EX | LOCK_NB);
  return opened;
}

}  // namespace plchost::modbus
