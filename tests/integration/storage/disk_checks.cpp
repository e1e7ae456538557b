#include "tests/integration/storage/disk_checks.hpp"

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "api/audit/audit_check.hpp"
#include "api/audit/audit_log.hpp"
#include "api/control/application_versions.hpp"
#include "api/security/sha256.hpp"
#include "instances/runtime/memory/retain_files.hpp"
#include "manager/store/instance_wish.hpp"
#include "shm/pages/exception_history.hpp"

namespace plchost {

namespace {

namespace fs = std::filesystem;

enum class Rule : std::uint8_t {
  whole,   // old or new contents, and the newest that were promised
  wish,    // and decode_wish() takes it
  faults,  // and read_exceptions() takes it
  retain,  // and RetainFiles::look() finds its values
  log,     // records that were promised; it goes on behind them
  left,    // by a process that was killed; the next one removes or replaces it
  none
};

Rule rule_of(const std::string& path) {
  constexpr std::array kRules{std::pair{".new", Rule::left},        std::pair{".part", Rule::left},
                              std::pair{".lock", Rule::left},       std::pair{".wish", Rule::wish},
                              std::pair{".events", Rule::whole},    std::pair{".exceptions", Rule::faults},
                              std::pair{"/boot", Rule::whole},      std::pair{".so", Rule::whole},
                              std::pair{".json", Rule::whole},      std::pair{".retain.0", Rule::retain},
                              std::pair{".retain.1", Rule::retain}, std::pair{".old", Rule::whole},
                              std::pair{".log", Rule::log},         std::pair{".plain", Rule::whole}};
  if (path.contains(DiskModel::kUnimportant)) return Rule::left;
  const auto rule =
      std::ranges::find_if(kRules, [&](const auto& each) { return path.ends_with(each.first); });
  return rule == kRules.end() ? Rule::none : rule->second;
}

}  // namespace

DiskChecks::DiskChecks(const DiskModel& model, std::string top, std::string folder)
    : model_(model), top_(std::move(top)), folder_(std::move(folder)) {
  fs::remove_all(folder_);
  fs::create_directories(folder_);
}

std::string DiskChecks::at(const std::string& path) const {
  return folder_ + path.substr(top_.size());
}

void DiskChecks::wrong(const CutDisk& disk, const std::string& path, const std::string& what) {
  if (problems_.size() < kMostProblems) problems_.push_back(fmt::format("{}: {}; {}", path, what, disk.told));
}

// Only what is another one than in the state before.
void DiskChecks::put(const FileTree& files) {
  std::vector<std::string> gone;
  for (const auto& [path, contents] : on_disk_)
    if (!files.contains(path)) gone.push_back(path);
  for (const std::string& path : gone) {
    fs::remove_all(at(path));
    on_disk_.erase(path);
  }
  for (const auto& [path, contents] : files) {
    const auto known = on_disk_.find(path);
    if (known != on_disk_.end() && known->second == contents) continue;
    if (contents) {
      std::ofstream(at(path), std::ios::binary | std::ios::trunc) << *contents;
    } else {
      fs::create_directory(at(path));
    }
    on_disk_[path] = contents;
  }
}

void DiskChecks::look_at_all(FileSystem file_system) {
  model_.for_each_cut(file_system, [this](const CutDisk& disk) {
    ++states_;
    put(disk.files);
    look_at(disk);
  });
}

void DiskChecks::look_at(const CutDisk& disk) {
  std::set<std::string> paths = model_.paths();
  for (const auto& [path, contents] : disk.files)
    if (contents) paths.insert(path);
  std::set<std::string> versions;
  std::set<std::string> logs;
  for (const std::string& path : paths) {
    look_at_file(disk, path);
    const std::string folder = fs::path(path).parent_path();
    if (rule_of(path) == Rule::log) logs.insert(folder);
    if (path.ends_with("/boot") || path.ends_with(".json")) versions.insert(folder);
  }
  for (const std::string& folder : versions) look_at_versions(disk, folder);
  for (const std::string& folder : logs) look_at_log(disk, folder);
}

void DiskChecks::look_at_file(const CutDisk& disk, const std::string& path) {
  const Rule rule = rule_of(path);
  if (rule == Rule::none) return wrong(disk, path, "no rule is known for this file");
  if (rule == Rule::left || rule == Rule::log) return;
  const auto found = disk.files.find(path);
  const auto contents = found == disk.files.end() ? nullptr : found->second;
  if (!model_.was_seen(path, contents, model_.promised(path, disk.cut), disk.cut)) {
    const auto kept = model_.seen(path, model_.promised(path, disk.cut));
    wrong(disk, path,
          fmt::format("{} where {} was promised",
                      contents ? fmt::format("{} bytes", contents->size()) : "no file",
                      kept ? fmt::format("{} bytes, or newer ones,", kept->size()) : "no file"));
  }
  if (!contents) return;
  if (rule == Rule::wish && !decode_wish(*contents)) wrong(disk, path, "it is no wish");
  if (rule == Rule::faults && !read_exceptions(at(path))) wrong(disk, path, "it has no exceptions");
  if (rule == Rule::retain) look_at_retain(disk, path);
}

void DiskChecks::look_at_retain(const CutDisk& disk, const std::string& path) {
  const fs::path file(at(path));
  const std::string name = file.filename();
  const auto found = RetainFiles::look(file.parent_path(), name.substr(0, name.find(".retain.")));
  if (!found.newest) wrong(disk, path, "no values are found");
  for (const std::string& problem : found.problems) wrong(disk, path, problem);
}

// A version that is listed is there as it was sent, and so is the boot application.
void DiskChecks::look_at_versions(const CutDisk& disk, const std::string& folder) {
  const ApplicationVersions versions = read_versions(at(folder));
  for (const ApplicationVersion& version : versions.kept) {
    const auto found = disk.files.find(version_path(folder, version.number));
    if (found == disk.files.end() || !found->second || sha256(*found->second) != version.digest)
      wrong(disk, version_path(folder, version.number), "it is listed, and is not what was sent");
  }
  if (!versions.boot.starts_with(folder + "/")) return;
  const bool kept = std::ranges::any_of(versions.kept, [&](const ApplicationVersion& version) {
    return version_path(folder, version.number) == versions.boot;
  });
  if (!kept) wrong(disk, folder + "/boot", "it names no version that is there");
}

void DiskChecks::look_at_log(const CutDisk& disk, const std::string& folder) {
  std::string seen = fmt::format("{} {} ", to_string(disk.file_system), disk.files.contains(folder));
  for (const std::string& path : model_.paths()) {
    if (!path.starts_with(folder + "/") || path.find('/', folder.size() + 1) != std::string::npos) continue;
    const std::size_t first = model_.promised(path, disk.cut);
    const auto promised = model_.seen(path, first);
    const auto found = disk.files.find(path);
    const bool gone = found == disk.files.end();
    seen += fmt::format("{} {} {} ", path, fmt::ptr(promised.get()),
                        fmt::ptr(gone ? nullptr : found->second.get()));
    if (!promised || (gone && model_.was_seen(path, nullptr, first, disk.cut))) continue;
    if (gone || !found->second->starts_with(*promised))
      wrong(disk, path, fmt::format("it has lost some of {} bytes that were promised", promised->size()));
  }
  if (!disk.files.contains(folder) || !logs_seen_.insert(std::move(seen)).second) return;
  const std::string here = at(folder);
  {
    const auto log = AuditLog::open({.folder = here});
    if (!log) return wrong(disk, folder, log.error().describe());
    AuditRecord record;
    record.what = "check";
    if (const auto added = (*log)->append(record); !added) wrong(disk, folder, added.error().describe());
  }
  const auto checked = check_audit(here);
  if (!checked) {
    wrong(disk, folder, checked.error().describe());
  } else if (disk.file_system == FileSystem::ordered) {
    for (const std::string& problem : checked->problems) wrong(disk, folder, problem);
  }
  // It was written to.
  fs::remove_all(here);
  std::erase_if(on_disk_, [&](const auto& each) {
    return each.first == folder || each.first.starts_with(folder + "/");
  });
}

std::vector<std::string> unrecorded(const DiskModel& model, const std::string& top) {
  FileTree known = model.live(model.changes());
  std::vector<std::string> wrong;
  for (const auto& entry : fs::recursive_directory_iterator(top)) {
    const std::string path = entry.path();
    const auto found = known.extract(path);
    const bool is_file = !entry.is_directory();
    std::ifstream file(path, std::ios::binary);
    const std::string contents =
        is_file ? std::string(std::istreambuf_iterator<char>(file), {}) : std::string();
    const bool same = found && (found.mapped() != nullptr) == is_file;
    if (!same || (is_file && *found.mapped() != contents)) wrong.push_back(path);
  }
  for (const auto& [path, contents] : known) wrong.push_back(path);
  return wrong;
}

}  // namespace plchost
