#include "api/audit/audit_file.hpp"

#include <algorithm>
#include <charconv>
#include <filesystem>

#include <fmt/format.h>

namespace plchost {

namespace {

constexpr std::string_view kPrefix = "audit.";
constexpr std::string_view kSuffix = ".log";

}  // namespace

std::string audit_file_name(std::uint64_t first) {
  return fmt::format("{}{:010}{}", kPrefix, first, kSuffix);
}

Result<std::vector<AuditFile>> audit_files(const std::string& folder) {
  std::vector<AuditFile> files;
  std::error_code error;
  for (std::filesystem::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    const std::string name = at->path().filename();
    if (!name.starts_with(kPrefix) || !name.ends_with(kSuffix)) continue;
    AuditFile file{.path = at->path()};
    const char* const digits = name.data() + kPrefix.size();
    const auto parsed = std::from_chars(digits, name.data() + name.size(), file.first);
    if (parsed.ec == std::errc() && name == audit_file_name(file.first)) files.push_back(std::move(file));
  }
  if (error) return failure(ErrorCode::system, "cannot read folder " + folder, error.value());
  std::ranges::sort(files, {}, &AuditFile::first);
  return files;
}

}  // namespace plchost
