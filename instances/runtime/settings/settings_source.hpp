#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <string_view>
#include <utility>

#include "shm/base/result.hpp"

namespace plchost {

inline constexpr std::size_t kMaxSettingsFile = std::size_t{1} << 20;

/// The texts of settings files, by the paths under which they were read.
using SettingsTexts = std::map<std::string, std::string>;

/// Where settings come from. Set-up.
class SettingsSource {
 public:
  virtual ~SettingsSource() = default;
  /// not_found, invalid_argument, refused, system: the file cannot be read; the text names it.
  [[nodiscard]] virtual Result<std::string> text(const std::string& file) = 0;
  /// The same for all paths that lead to one file. not_found: there is none.
  [[nodiscard]] virtual Result<std::string> identity(const std::string& file) = 0;
};

/// The files themselves.
class SettingsFiles : public SettingsSource {
 public:
  [[nodiscard]] Result<std::string> text(const std::string& file) override;
  [[nodiscard]] Result<std::string> identity(const std::string& file) override;
  /// Of all files that were read.
  [[nodiscard]] const SettingsTexts& texts() const noexcept { return texts_; }

 private:
  SettingsTexts texts_;
};

/// Texts that were kept. A file that they do not have is not there.
class KeptSettings : public SettingsSource {
 public:
  KeptSettings(std::string file, SettingsTexts texts) noexcept
      : file_(std::move(file)), texts_(std::move(texts)) {}
  [[nodiscard]] Result<std::string> text(const std::string& file) override;
  [[nodiscard]] Result<std::string> identity(const std::string& file) override;
  /// The file that the others were read from; empty: there were no settings.
  [[nodiscard]] const std::string& file() const noexcept { return file_; }
  [[nodiscard]] const SettingsTexts& texts() const noexcept { return texts_; }

 private:
  std::string file_;
  SettingsTexts texts_;
};

/// Keeps the texts in the file at `path`. `file`: the first one, or empty. system: they are not kept. Set-up.
[[nodiscard]] Result<void> keep_settings(const std::string& path, const std::string& file,
                                         const SettingsTexts& texts);
/// not_found, corrupt, system: no settings are kept there. Set-up.
[[nodiscard]] Result<KeptSettings> read_kept_settings(const std::string& path);

}  // namespace plchost
