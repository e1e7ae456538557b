#include "manager/host_check/host_files.hpp"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <filesystem>

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include "shm/base/cpu_list.hpp"
#include "shm/base/unique_fd.hpp"

namespace plchost {

namespace {

std::unexpected<Error> unreadable(const std::string& path, int error) {
  const bool missing = error == ENOENT || error == ENOTDIR;
  return failure(missing ? ErrorCode::not_found : ErrorCode::refused, path, error);
}

std::unexpected<Error> unexpected_content(const std::string& path, std::string_view text) {
  constexpr std::size_t kShown = 40;
  const bool cut = text.size() > kShown;
  return failure(ErrorCode::corrupt,
                 fmt::format("{} holds '{}{}'", path, text.substr(0, kShown), cut ? "..." : ""));
}

}  // namespace

Result<std::string> HostFiles::text(const std::string& path) const {
  const UniqueFd fd(::open((root_ + path).c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (!fd) return unreadable(path, errno);
  std::string text(kMaxText, '\0');
  std::size_t size = 0;
  while (size < text.size()) {
    const ssize_t length = ::read(fd.get(), text.data() + size, text.size() - size);
    if (length < 0) return unreadable(path, errno);
    if (length == 0) break;
    size += static_cast<std::size_t>(length);
  }
  text.resize(size);
  while (text.ends_with('\n')) text.pop_back();
  const auto is_text = [](char c) { return static_cast<unsigned char>(c) >= ' ' || c == '\n' || c == '\t'; };
  if (!std::ranges::all_of(text, is_text)) {
    return failure(ErrorCode::corrupt, fmt::format("{} holds bytes that are no text", path));
  }
  return text;
}

Result<std::int64_t> HostFiles::number(const std::string& path) const {
  PLCHOST_TRY_ASSIGN(const auto content, text(path));
  std::int64_t number = 0;
  const char* const end = content.data() + content.size();
  const auto [stopped, error] = std::from_chars(content.data(), end, number);
  if (error != std::errc() || stopped != end) return unexpected_content(path, content);
  return number;
}

Result<std::vector<int>> HostFiles::cores(const std::string& path) const {
  PLCHOST_TRY_ASSIGN(const auto content, text(path));
  auto list = parse_cpu_list(content == "(null)" ? std::string_view() : std::string_view(content));
  if (!list) return unexpected_content(path, content);
  return *std::move(list);
}

Result<std::vector<int>> HostFiles::core_mask(const std::string& path) const {
  PLCHOST_TRY_ASSIGN(const auto content, text(path));
  auto mask = parse_cpu_mask(content);
  if (!mask) return unexpected_content(path, content);
  return *std::move(mask);
}

Result<std::vector<std::string>> HostFiles::names(const std::string& path) const {
  std::error_code error;
  std::filesystem::directory_iterator at(root_ + path, error);
  if (error) return unreadable(path, error.value());
  std::vector<std::string> found;
  for (const std::filesystem::directory_iterator end; !error && at != end; at.increment(error)) {
    found.push_back(at->path().filename().string());
  }
  std::ranges::sort(found);
  return found;
}

bool HostFiles::exists(const std::string& path) const {
  return ::access((root_ + path).c_str(), F_OK) == 0;
}

Result<void> HostFiles::writable(const std::string& path) const {
  if (::access((root_ + path).c_str(), W_OK) == 0) return {};
  return unreadable(path, errno);
}

bool HostFiles::kernel_lacks(const std::string& path) const {
  return !exists(path) && exists(path.substr(0, path.rfind('/')));
}

}  // namespace plchost
