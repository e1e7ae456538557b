#include "instances/runtime/memory/retain_files.hpp"

#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include "shm/base/system_call.hpp"
#include "shm/base/unique_fd.hpp"
#include "shm/files/own_folder.hpp"
#include "shm/files/replace_file.hpp"

namespace plchost {

namespace {

// No file of ours is larger; a larger one is not read.
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
  if (!stream) return failure(ErrorCode::system, "cannot read " + path, errno);
  return text;
}

std::string stem_of(const std::string& directory, const std::string& instance) {
  return fmt::format("{}/{}.retain", directory, instance);
}

Result<void> copy_and_sync(const std::string& path, const std::string& fresh) {
  std::error_code error;
  std::filesystem::copy_file(path, fresh, std::filesystem::copy_options::overwrite_existing, error);
  if (error) return failure(ErrorCode::system, "cannot copy " + path + " to " + fresh, error.value());
  const UniqueFd copy(::open(fresh.c_str(), O_RDONLY | O_NOFOLLOW | O_CLOEXEC));
  if (!copy) return failure(ErrorCode::system, "cannot open " + fresh, errno);
  PLCHOST_TRY(check_errno(::fsync(copy.get()), "cannot sync " + fresh));
  return {};
}

// Of any size: it may be no file of ours. The copy is whole before it takes the place of the one before.
Result<void> put_copy_aside(const std::string& path) {
  std::error_code error;
  if (!std::filesystem::exists(path, error)) return {};
  const std::string aside = path + ".old";
  const std::string fresh = aside + ".new";
  if (auto copied = copy_and_sync(path, fresh); !copied) {
    ::unlink(fresh.c_str());  // half a copy only takes room, of which there may be too little
    return copied;
  }
  if (::rename(fresh.c_str(), aside.c_str()) == 0) return {};
  return failure(ErrorCode::system, "cannot rename " + fresh, errno);
}

}  // namespace

auto RetainFiles::look(const std::string& directory, const std::string& instance) -> Found {
  return RetainFiles(stem_of(directory, instance), directory).read();
}

Result<RetainFiles> RetainFiles::open(const std::string& directory, const std::string& instance) {
  RetainFiles files(stem_of(directory, instance), directory);
  const auto taken = files.take();
  if (!taken && taken.error().code == ErrorCode::busy) return std::unexpected(taken.error());
  return files;
}

Result<void> RetainFiles::take() {
  if (lock_) return {};
  constexpr mode_t kMode = 0755;
  const auto made = make_synced_folder(directory_, kMode);
  if (!made && made.error().system_errno != EROFS) {
    return failure(ErrorCode::system, "folder for retain variables: " + made.error().message,
                   made.error().system_errno);
  }
  PLCHOST_TRY(in_step("folder for retain variables", check_own_folder(directory_)));
  auto held = LockFile::take(stem_ + ".lock");
  // Of an instance with a user of its own. In the folder of this user only he and root can remove it; that no
  // other process has this name is the matter of its claim.
  if (!held && held.error().code == ErrorCode::refused && ::unlink((stem_ + ".lock").c_str()) == 0)
    held = LockFile::take(stem_ + ".lock");
  if (!held && held.error().code == ErrorCode::already_exists) {
    return failure(ErrorCode::busy, fmt::format("{}: retain files have one instance", held.error().message));
  }
  PLCHOST_TRY_ASSIGN(lock_, std::move(held));
  return {};
}

std::string RetainFiles::path(std::uint64_t generation) const {
  return fmt::format("{}.{}", stem_, generation % 2);
}

auto RetainFiles::read() const -> Found {
  Found found;
  // A file that a stranger can put there becomes no value of a machine.
  if (const auto ours = check_own_folder(directory_); !ours && ours.error().code == ErrorCode::refused) {
    found.problems.push_back(ours.error().describe());
    return found;
  }
  for (std::uint64_t file = 0; file < 2; ++file) {
    const auto text = read_whole(path(file));
    if (!text) {
      if (text.error().code == ErrorCode::not_found) continue;
      found.problems.push_back(text.error().describe());
      found.damaged.set(file);
      continue;
    }
    auto image = decode_retain(*text);
    if (!image) {
      found.problems.push_back(
          fmt::format("{}: {}; it is put aside as .old", path(file), image.error().message));
      found.damaged.set(file);
    } else if (!found.newest || image->generation > found.newest->generation) {
      found.newest = *std::move(image);
    }
  }
  return found;
}

Result<void> RetainFiles::write(const RetainImage& image) {
  if (auto taken = take(); !taken) return taken;
  // The file is whole before it gets its name, and has its name for good before it counts as written.
  if (auto written = replace_file(path(image.generation), encode(image)); !written) return written;
  return sync_directory(directory_);
}

Result<void> RetainFiles::put_aside(std::bitset<2> which) const {
  Result<void> done;
  for (std::uint64_t file = 0; file < 2; ++file) {
    if (!which[file]) continue;
    auto put = put_copy_aside(path(file));
    if (!put && done) done = std::move(put);
  }
  if (!which.any()) return done;
  auto synced = sync_directory(directory_);
  return done ? synced : done;
}

}  // namespace plchost
