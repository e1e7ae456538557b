#include "api/server/status/application_watch.hpp"

#include <algorithm>

#include <fmt/format.h>
#include <sys/stat.h>

#include "api/dds/text.hpp"

namespace plchost {

namespace {

// Clocks of file systems are coarse: a file that was changed so recently may change again within the same
// time.
constexpr std::int64_t kSettled = 1'000'000'000;

// 0: there is none.
std::int64_t change_time(const std::string& folder) {
  struct stat status{};
  if (::stat(folder.c_str(), &status) != 0) return 0;
  return status.st_mtim.tv_sec * 1'000'000'000 + status.st_mtim.tv_nsec;
}

}  // namespace

bool ApplicationWatch::look(const std::vector<std::string>& instances, TimePoint now) {
  if (folder_.empty() || now < next_) return false;
  next_ = now + kPeriod;
  std::erase_if(known_,
                [&](const auto& one) { return std::ranges::find(instances, one.first) == instances.end(); });
  for (const std::string& instance : instances) {
    Known& known = known_[instance];
    const std::int64_t changed = change_time(versions_folder(folder_, instance));
    if (!known.settled || changed != known.changed_ns) read(instance, known);
  }
  return show();
}

bool ApplicationWatch::look_at(const std::string& instance) {
  if (folder_.empty() || instance.empty()) return false;
  read(instance, known_[instance]);
  return show();
}

void ApplicationWatch::read(const std::string& instance, Known& known) const {
  const std::string folder = versions_folder(folder_, instance);
  known.changed_ns = change_time(folder);
  known.settled = unix_time_ns() - known.changed_ns > kSettled;
  known.samples.clear();
  const auto make = [&] {
    plc_ApplicationStatus& sample = known.samples.emplace_back(table_->blank());
    dds::copy_text(sample.instance, instance);
    return &sample;
  };
  const ApplicationVersions versions = read_versions(folder);
  bool boot_is_kept = versions.boot.empty();
  for (const ApplicationVersion& version : versions.kept) {
    plc_ApplicationStatus& sample = *make();
    sample.version = version.number;
    dds::copy_text(sample.path, version.path);
    dds::copy_text(sample.file_name, version.name);
    dds::copy_text(sample.sha256, version.digest);
    sample.size = version.size;
    sample.stored_unix_ns = version.stored_unix_ns;
    dds::copy_text(sample.by, version.by);
    dds::copy_text(sample.from, version.from);
    dds::copy_text(sample.before, version.before);
    sample.boot = version.path == versions.boot;
    boot_is_kept |= sample.boot;
  }
  if (boot_is_kept) return;
  plc_ApplicationStatus& sample = *make();
  dds::copy_text(sample.path, versions.boot);
  sample.boot = true;
}

bool ApplicationWatch::show() {
  bool changed = false;
  table_->begin_round();
  for (const auto& [instance, known] : known_) {
    for (const plc_ApplicationStatus& sample : known.samples) {
      changed |= table_->update(fmt::format("{}/{}", instance, sample.version), sample);
    }
  }
  changed |= table_->dispose_rest();
  table_->write();
  return changed;
}

}  // namespace plchost
