#include "instances/runtime/settings/read_settings.hpp"

#include <algorithm>
#include <filesystem>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "instances/runtime/settings/settings_parser.hpp"
#include "shm/base/names.hpp"

namespace plchost {

namespace {

namespace fs = std::filesystem;

/// Reads a file, then those that it refers to, one after the other, each with its own references.
class FileWalk {
 public:
  explicit FileWalk(SettingsSource& source) noexcept : source_(source) {}

  Result<void> read(const std::string& file) {
    PLCHOST_TRY_ASSIGN(const auto text, source_.text(file));
    const fs::path folder = fs::absolute(file).parent_path();
    PLCHOST_TRY_ASSIGN(const auto references, parser_.read(text, file, folder));
    const fs::path self = source_.identity(file).value_or("");
    chain_.push_back(self);
    read_.insert(self);
    for (const FileReference& reference : references) {
      if (auto followed = follow(reference, folder); !followed) return followed;
    }
    chain_.pop_back();
    return {};
  }

  Result<InstanceSettings> finish() { return std::move(parser_).finish(); }

 private:
  Result<void> follow(const FileReference& reference, const fs::path& folder) {
    const fs::path path = (folder / reference.path).lexically_normal();
    const auto bad = [&](std::string_view what) {
      return failure(ErrorCode::invalid_argument,
                     fmt::format("{}: FileReference to {}: {}", reference.where, shown(path.native()), what));
    };
    const auto known = source_.identity(path);
    if (!known) {
      parser_.remark(reference.where, fmt::format("FileReference to {}: {}, so it is read without that",
                                                  shown(path.native()), known.error().message));
      return {};
    }
    const fs::path file = *known;
    if (std::ranges::find(chain_, file) != chain_.end()) return bad("it refers back to this file");
    if (read_.contains(file)) return {};
    if (chain_.size() > kMaxReferenceDepth || read_.size() >= kMaxSettingsFiles) {
      return bad(fmt::format("more than {} files behind each other, or {} in all", kMaxReferenceDepth,
                             kMaxSettingsFiles));
    }
    return read(path);
  }

  SettingsSource& source_;
  SettingsParser parser_;
  std::vector<fs::path> chain_;  // from the first file to the one that is read
  std::set<fs::path> read_;
};

}  // namespace

Result<InstanceSettings> parse_settings(std::string_view text, std::string_view file) {
  SettingsParser parser;
  PLCHOST_TRY(parser.read(text, std::string(file), ""));
  return std::move(parser).finish();
}

Result<InstanceSettings> read_settings(const std::string& file) {
  SettingsFiles files;
  return read_settings(file, files);
}

Result<InstanceSettings> read_settings(const std::string& file, SettingsSource& source) {
  FileWalk walk(source);
  PLCHOST_TRY(walk.read(file));
  return walk.finish();
}

}  // namespace plchost
