#include "instances/io/modbus/images/process_image.hpp"

#include <array>
#include <cerrno>
#include <utility>

#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include "shm/base/names.hpp"

namespace plchost::modbus {

namespace {

std::string_view hint_for(int error) {
  switch (error) {
    case EBUSY:
      return "another process writes it; end that one, or give it another image";
    case EPROTO:
      return "there is another kind of memory, or an image of another size; give both sides one size";
    default:
      return "cannot be opened";
  }
}

}  // namespace

ProcessImage::ProcessImage(std::string pool, std::string name, const plc_image& image)
    : pool_(std::move(pool)),
      name_(std::move(name)),
      image_(image),
      guard_(std::span(reinterpret_cast<std::byte*>(image.header), image.mapped)) {}

ProcessImage::ProcessImage(ProcessImage&& other) noexcept
    : pool_(std::move(other.pool_)),
      name_(std::move(other.name_)),
      image_(std::exchange(
          other.image_,
          plc_image{.header = nullptr, .mapped = 0, .size = 0, .descriptor = -1, .device = 0, .inode = 0})),
      guard_(std::move(other.guard_)) {}

ProcessImage& ProcessImage::operator=(ProcessImage&& other) noexcept {
  std::swap(pool_, other.pool_);
  std::swap(name_, other.name_);
  std::swap(image_, other.image_);
  std::swap(guard_, other.guard_);
  return *this;
}

ProcessImage::~ProcessImage() {
  guard_ = MemoryGuard();  // before the memory goes
  plc_image_close(&image_);
}

Result<ProcessImage> ProcessImage::open(const std::string& pool, const std::string& name, std::uint32_t size,
                                        int access) {
  plc_image image{};
  const int error = plc_image_open(pool.c_str(), name.c_str(), size, access, &image);
  if (error != 0) {
    return failure(
        error == EBUSY ? ErrorCode::busy : ErrorCode::system,
        fmt::format("image '{}' of pool '{}', {} bytes: {}", shown(name), pool, size, hint_for(error)),
        error);
  }
  ProcessImage opened(pool, name, image);
  if (!opened.guard_) {
    return failure(ErrorCode::full, fmt::format("more than {} memories of others", MemoryGuard::kMost));
  }
  return opened;
}

bool ProcessImage::exists(const std::string& pool, const std::string& name) {
  std::array<char, PLC_IMAGE_PATH_SIZE> path{};
  return plc_image_path(pool.c_str(), name.c_str(), path.data()) == 0 && ::access(path.data(), F_OK) == 0;
}

void ProcessImage::unlock() const noexcept {
  (void)::flock(image_.descriptor, LOCK_UN);
}

void ProcessImage::lock() const noexcept {
  (void)::flock(image_.descriptor, LOCK_EX | LOCK_NB);
}

bool ProcessImage::gone() const {
  return guard_.lost() || plc_image_gone(&image_, pool_.c_str(), name_.c_str()) != 0;
}

}  // namespace plchost::modbus
