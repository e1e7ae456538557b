#include "shm/toml/text_file.hpp"

#include <cerrno>
#include <filesystem>
#include <fstream>
#include <system_error>

#include <fmt/format.h>
#include <unistd.h>

namespace plchost {

Result<void> check_readable_file(const std::string& path) {
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (!std::filesystem::exists(status)) {
    return failure(ErrorCode::not_found, fmt::format("there is no file {}", path));
  }
  if (!std::filesystem::is_regular_file(status)) {
    return failure(ErrorCode::invalid_argument, fmt::format("{} is not a file", path));
  }
  if (::access(path.c_str(), R_OK) != 0) {
    return failure(ErrorCode::refused, fmt::format("{} cannot be read", path), errno);
  }
  return {};
}

Result<std::string> read_config_text(const std::string& path, std::size_t most) {
  PLCHOST_TRY(check_readable_file(path));
  std::ifstream stream(path, std::ios::binary);
  std::string text(most + 1, '\0');
  stream.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (stream.bad()) return failure(ErrorCode::system, "cannot be read", errno);  // half a file is another one
  text.resize(static_cast<std::size_t>(stream.gcount()));
  if (text.size() > most) {
    return failure(ErrorCode::invalid_argument,
                   fmt::format("is larger than the {} bytes that are allowed", most));
  }
  return text;
}

}  // namespace plchost
