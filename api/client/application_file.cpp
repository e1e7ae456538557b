#include "api/client/application_file.hpp"

#include <cerrno>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <system_error>

#include <fmt/format.h>

#include "shm/pages/host_words.hpp"

namespace plchost {

namespace {

/// The most that [host] application_limit_mib can allow.
constexpr std::uintmax_t kLargest = std::uintmax_t{kMaxApplicationMib} << 20U;

}  // namespace

Result<std::string> read_application(const std::string& path, std::string_view hint) {
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) {
    return failure(ErrorCode::wrong_type, path + " is a folder");
  }
  if (std::filesystem::exists(path, error) && !std::filesystem::is_regular_file(path, error)) {
    return failure(ErrorCode::wrong_type, path + " is no plain file");
  }
  if (const auto size = std::filesystem::file_size(path, error); !error && size > kLargest) {
    return failure(ErrorCode::wrong_size,
                   fmt::format("{} has {} bytes; no host takes more than {}", path, size, kLargest));
  }
  std::ifstream file(path, std::ios::binary);
  if (!file) return failure(ErrorCode::system, fmt::format("{} cannot be opened here{}", path, hint), errno);
  std::string contents;
  try {
    contents.assign(std::istreambuf_iterator<char>(file), {});
  } catch (const std::system_error& problem) {  // thrown by the buffer of the stream
    return failure(ErrorCode::system, "cannot read " + path, problem.code().value());
  }
  if (contents.empty()) return failure(ErrorCode::wrong_size, path + " is empty");
  return contents;
}

}  // namespace plchost
