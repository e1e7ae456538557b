#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "instances/runtime/settings/settings.hpp"
#include "instances/runtime/settings/settings_key.hpp"
#include "shm/base/result.hpp"

namespace plchost {

/// [CmpSettings] FileReference.N: a file that is to be read after the one that names it.
struct FileReference {
  std::string path;   ///< as written
  std::string where;  ///< "line1.cfg:12"
};

/// Makes one set of settings of the texts of one or more files. A later value of the same key counts.
class SettingsParser {
 public:
  /// `file` is how texts call it; relative paths in it are made to count from `folder`, unless that is empty.
  /// Returns what it refers to, by number. After an error there is only that error.
  [[nodiscard]] Result<std::vector<FileReference>> read(std::string_view text, const std::string& file,
                                                        const std::string& folder);
  void remark(std::string_view where, std::string_view what);
  [[nodiscard]] Result<InstanceSettings> finish() &&;

 private:
  [[nodiscard]] std::string place() const;
  [[nodiscard]] bool in_foreign_section() const { return !section_.empty() && !owned_; }
  [[nodiscard]] std::string_view next_line();
  void fail(std::string_view what);
  void read_line(std::string_view line);
  void begin_section(std::string_view line);
  void enter(std::string_view name, bool owned);
  void begin_task(std::string_view name);
  void set(std::string_view name, std::string_view value);
  void read_reference(std::string_view line);
  void take_components();
  void take_areas();
  void check_sys_time();

  // Of the file that is read.
  std::string_view rest_;
  std::string file_;
  std::string folder_;
  int line_ = 0;
  std::string_view section_;
  bool owned_ = false;
  std::optional<std::size_t> task_;  // of the section [Task.NAME], in settings_.tasks
  std::map<unsigned, FileReference> references_;

  // Of all files.
  InstanceSettings settings_;
  std::map<std::size_t, std::string> components_;
  std::map<std::size_t, AreaDraft> areas_;
  std::map<std::string, std::size_t> tasks_;  // their places in settings_.tasks
  std::set<std::string> foreign_;
  std::map<std::string, std::string> seen_;  // each key's last place
  std::optional<Error> error_;
};

}  // namespace plchost
