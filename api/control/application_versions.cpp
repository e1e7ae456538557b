#include "api/control/application_versions.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <filesystem>
#include <fstream>
#include <iterator>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "shm/base/names.hpp"

namespace plchost {

namespace {

using Json = nlohmann::json;

// More is none of ours.
constexpr std::size_t kMaxDescription = 8192;

struct VersionText {
  const char* key;
  std::string ApplicationVersion::* member;
};
constexpr std::array kVersionTexts = {
    VersionText{"name", &ApplicationVersion::name}, VersionText{"sha256", &ApplicationVersion::digest},
    VersionText{"by", &ApplicationVersion::by}, VersionText{"from", &ApplicationVersion::from},
    VersionText{"before", &ApplicationVersion::before}};

std::string read_small(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::string text(kMaxDescription, '\0');
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(std::max<std::streamsize>(file.gcount(), 0)));
  return text;
}

// "000003.json"; 0: it is no such name.
std::uint32_t number_of(const std::filesystem::path& path, std::string_view extension) {
  const std::string stem = path.stem().string();
  std::uint32_t number = 0;
  const auto [end, error] = std::from_chars(stem.data(), stem.data() + stem.size(), number);
  const bool whole = error == std::errc() && end == stem.data() + stem.size();
  return whole && path.extension() == extension ? number : 0;
}

std::optional<ApplicationVersion> read_version(const std::string& folder, std::uint32_t number) {
  const std::string path = version_path(folder, number);
  auto version = decode_version(read_small(description_path(path)));
  std::error_code error;
  if (!version || !std::filesystem::is_regular_file(path, error)) return std::nullopt;
  version->number = number;
  version->path = path;
  return *std::move(version);
}

}  // namespace

std::string applications_folder(std::string_view state_directory, std::string_view host) {
  return fmt::format("{}/applications.{}", state_directory, host);
}

std::string versions_folder(std::string_view applications_folder, std::string_view instance) {
  return fmt::format("{}/{}", applications_folder, instance);
}

std::string version_path(std::string_view folder, std::uint32_t number) {
  return fmt::format("{}/{:06}.so", folder, number);
}

std::string description_path(std::string_view path) {
  return std::filesystem::path(path).replace_extension(".json").string();
}

std::string boot_path(std::string_view folder) {
  return fmt::format("{}/boot", folder);
}

ApplicationVersions read_versions(const std::string& folder) {
  ApplicationVersions versions;
  std::error_code error;
  for (std::filesystem::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    const std::uint32_t number = number_of(at->path(), ".json");
    if (number == 0) continue;
    if (auto version = read_version(folder, number)) versions.kept.push_back(*std::move(version));
  }
  std::ranges::sort(versions.kept, {}, &ApplicationVersion::number);
  versions.boot = read_boot(folder);
  return versions;
}

std::optional<ApplicationVersion> version_at(const std::string& folder, const std::string& path) {
  const std::uint32_t number = number_of(path, ".so");
  if (number == 0 || version_path(folder, number) != path) return std::nullopt;
  return read_version(folder, number);
}

std::string read_boot(const std::string& folder) {
  const std::string path = read_small(boot_path(folder));
  return path.starts_with('/') && path.size() <= kMaxPath ? path : std::string();
}

std::string encode(const ApplicationVersion& version) {
  Json json{{"size", version.size}, {"stored_unix_ns", version.stored_unix_ns}};
  for (const VersionText& text : kVersionTexts) json[text.key] = version.*text.member;
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

Result<ApplicationVersion> decode_version(std::string_view text) {
  const Json json = Json::parse(text, nullptr, false);
  if (!json.is_object()) return failure(ErrorCode::corrupt, "the description is not a JSON object");
  ApplicationVersion version;
  for (const VersionText& member : kVersionTexts) {
    const auto found = json.find(member.key);
    if (found == json.end() || !found->is_string()) {
      return failure(ErrorCode::corrupt, fmt::format("the description has no text '{}'", member.key));
    }
    version.*member.member = found->get<std::string>();
  }
  const auto size = json.find("size");
  const auto stored = json.find("stored_unix_ns");
  if (size == json.end() || !size->is_number_unsigned() || stored == json.end() ||
      !stored->is_number_integer()) {
    return failure(ErrorCode::corrupt, "the description has no size or no time");
  }
  version.size = size->get<std::uint64_t>();
  version.stored_unix_ns = stored->get<std::int64_t>();
  return version;
}

}  // namespace plchost
