#include "instances/runtime/retain/retain_files.hpp"

#include <cerrno>
#include <filesystem>
#include <fstream>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>

#include "shm/base/replace_file.hpp"
#include "shm/base/system_call.hpp"

namespace plchost {

namespace {

// No file of ours is larger; what is, is not read.
constexpr std::size_t kMaxFile = kMaxRetainBytes + (std::size_t{1} << 16);

Result<std::string> read_whole(const std::string& path) {
  std::error_code error;
  const auto size = std::filesystem::file_size(path, error);
  if (error == std::errc::no_such_file_or_directory) return failure(ErrorCode::not_found, path);
  if (error) return failure(ErrorCode::system, path, error.value());
  if (size > kMaxFile) return failure(ErrorCode::corrupt, fmt::format("{} has {} bytes", path, size));
  std::string text(size, '\0');
  std::ifstream stream(path, std::ios::binary);
  stream.read(text.data(), static_cast<std::streamsize>(size));
  if (!stream) return failure(ErrorCode::system, "read " + path, errno);
  return text;
}

Result<UniqueFd> lock(const std::string& path) {
  UniqueFd fd(::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0600));
  if (!fd) return failure(ErrorCode::system, "open " + path, errno);
  if (::flock(fd.get(), LOCK_EX | LOCK_NB) == 0) return fd;
  const int error = errno;
  if (error != EWOULDBLOCK) return failure(ErrorCode::system, "lock " + path, error);
  return failure(ErrorCode::busy,
                 fmt::format("{} is held by another process: retain files have one instance", path));
}

}  // namespace

Result<RetainFiles> RetainFiles::open(const std::string& directory, const std::string& instance) {
  constexpr mode_t kMode = 0755;
  const int error = ::mkdir(directory.c_str(), kMode) == 0 ? 0 : errno;
  if (error != 0 && error != EEXIST) {
    return failure(ErrorCode::system, fmt::format("make the folder for retain variables {}", directory),
                   error);
  }
  const std::string stem = fmt::format("{}/{}.retain", directory, instance);
  auto held = lock(stem + ".lock");
  if (!held) return std::unexpected(std::move(held).error());
  return RetainFiles(stem, directory, *std::move(held));
}

std::string RetainFiles::path(std::uint64_t generation) const {
  return fmt::format("{}.{}", stem_, generation % 2);
}

auto RetainFiles::read() const -> Found {
  Found found;
  for (std::uint64_t file = 0; file < 2; ++file) {
    const auto text = read_whole(path(file));
    if (!text) {
      if (text.error().code != ErrorCode::not_found) found.problems.push_back(text.error().describe());
      continue;
    }
    auto image = decode_retain(*text);
    if (!image) {
      found.problems.push_back(fmt::format("{}: {}", path(file), image.error().message));
    } else if (!found.newest || image->generation > found.newest->generation) {
      found.newest = *std::move(image);
    }
  }
  return found;
}

Result<void> RetainFiles::write(const RetainImage& image) const {
  // The file is whole before it gets its name, and has its name for good before it counts as written.
  if (auto written = replace_file(path(image.generation), encode(image)); !written) return written;
  return sync_directory(directory_);
}

void RetainFiles::put_aside() const {
  for (std::uint64_t file = 0; file < 2; ++file) {
    std::error_code error;  // one that is not there needs no place
    std::filesystem::copy_file(path(file), path(file) + ".old",
                               std::filesystem::copy_options::overwrite_existing, error);
  }
}

}  // namespace plchost
