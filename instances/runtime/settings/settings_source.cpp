#include "instances/runtime/settings/settings_source.hpp"

#include <cerrno>
#include <filesystem>
#include <fstream>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "instances/runtime/settings/settings.hpp"
#include "shm/files/read_plain_file.hpp"
#include "shm/files/replace_file.hpp"

namespace plchost {

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

// The manager's group reads it: a process of another user may be the next one.
constexpr mode_t kKeptMode = 0640;
constexpr std::size_t kMaxKept = 2 * kMaxSettingsFiles * kMaxSettingsFile;  // with room for names

Result<std::string> read_text(const std::string& file) {
  std::error_code error;
  if (!fs::exists(file, error)) {
    return failure(ErrorCode::not_found, fmt::format("settings file {} does not exist", file));
  }
  if (!fs::is_regular_file(file, error)) {
    return failure(ErrorCode::invalid_argument, fmt::format("settings file {} is not a file", file));
  }
  std::ifstream stream(file, std::ios::binary);
  std::string text(kMaxSettingsFile + 1, '\0');
  if (!stream) return failure(ErrorCode::refused, fmt::format("cannot open settings file {}", file), errno);
  stream.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (stream.bad())
    return failure(ErrorCode::system, fmt::format("cannot read settings file {}", file), errno);
  text.resize(static_cast<std::size_t>(stream.gcount()));
  if (text.size() > kMaxSettingsFile) {
    return failure(ErrorCode::invalid_argument,
                   fmt::format("settings file {} is larger than {} bytes", file, kMaxSettingsFile));
  }
  return text;
}

}  // namespace

Result<std::string> SettingsFiles::text(const std::string& file) {
  auto text = read_text(file);
  if (text) texts_[file] = *text;
  return text;
}

Result<std::string> SettingsFiles::identity(const std::string& file) {
  std::error_code error;
  const fs::path path = fs::canonical(file, error);
  if (error) return failure(ErrorCode::not_found, error.message());
  return path.native();
}

Result<std::string> KeptSettings::text(const std::string& file) {
  const auto found = texts_.find(file);
  if (found != texts_.end()) return found->second;
  return failure(ErrorCode::not_found,
                 fmt::format("settings file {} is not among those that were kept", file));
}

Result<std::string> KeptSettings::identity(const std::string& file) {
  if (texts_.contains(file)) return file;
  return failure(ErrorCode::not_found, "it is not among those that were kept");
}

Result<void> keep_settings(const std::string& path, const std::string& file, const SettingsTexts& texts) {
  // A settings file can have any bytes, and a text of JSON cannot.
  Json json{{"file", file}, {"texts", Json::object()}};
  for (const auto& [name, text] : texts) json["texts"][name] = Json::binary({text.begin(), text.end()});
  const std::vector<std::uint8_t> bytes = Json::to_cbor(json);
  return replace_file(path, std::string(bytes.begin(), bytes.end()), kKeptMode);
}

Result<KeptSettings> read_kept_settings(const std::string& path) {
  const auto corrupt = [&] {
    return failure(ErrorCode::corrupt, fmt::format("{} does not hold kept settings", path));
  };
  // Read as root, in a folder that the user of instances can write.
  PLCHOST_TRY_ASSIGN(const std::string bytes, read_plain_file(path, kMaxKept));
  const Json json = Json::from_cbor(bytes, true, false);
  if (!json.is_object() || !json.contains("file") || !json["file"].is_string() || !json.contains("texts") ||
      !json["texts"].is_object()) {
    return corrupt();
  }
  SettingsTexts texts;
  for (const auto& [name, text] : json["texts"].items()) {
    if (!text.is_binary()) return corrupt();
    texts.emplace(name, std::string(text.get_binary().begin(), text.get_binary().end()));
  }
  return KeptSettings(json["file"].get<std::string>(), std::move(texts));
}

}  // namespace plchost
