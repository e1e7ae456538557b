// storage_replay mark TEXT                     adds it to the recording $RECORDING
// storage_replay check RECORDING TOP FOLDER    looks at each state that a power cut may have left in TOP,
// which it
//                                              puts into FOLDER
// storage_replay leave RECORDING TOP FOLDER N  leaves N of them in FOLDER/1 to FOLDER/N
#include <array>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "tests/integration/storage/disk_checks.hpp"
#include "tests/integration/storage/disk_model.hpp"

extern "C" void mark_recording(const char* text);

namespace plchost {
namespace {

Result<DiskModel> model_of(const std::string& recording, const std::string& top) {
  PLCHOST_TRY_ASSIGN(auto changes, read_recording(recording));
  return DiskModel::make(std::move(changes), top);
}

int check(const DiskModel& model, const std::string& top, const std::string& folder) {
  for (const std::string& path : unrecorded(model, top)) {
    fmt::print(stderr, "{}: it is not as the recording says\n", path);
    return 1;
  }
  DiskChecks checks(model, top, folder);
  for (const FileSystem file_system : {FileSystem::ordered, FileSystem::weak}) {
    const std::size_t before = checks.states();
    checks.look_at_all(file_system);
    fmt::print("{} changes, {} states of the disk: {} file system\n", model.changes(),
               checks.states() - before, to_string(file_system));
  }
  for (const std::string& problem : checks.problems()) fmt::print(stderr, "{}\n", problem);
  return checks.problems().empty() ? 0 : 1;
}

/// Of all cuts, with as much lost as can be.
int leave(const DiskModel& model, const std::string& top, const std::string& folder, std::size_t most) {
  std::vector<CutDisk> disks(most);
  model.for_each_cut(FileSystem::weak, [&](const CutDisk& disk) {
    // The second state of a cut is the one without anything that was not synced.
    CutDisk& known = disks[(disk.cut * most - 1) / std::max<std::size_t>(model.changes(), 1) % most];
    if (known.cut != disk.cut || known.told.size() < disk.told.size()) known = disk;
  });
  for (std::size_t i = 0; i < disks.size(); ++i) {
    DiskChecks(model, top, fmt::format("{}/{}", folder, i + 1)).put(disks[i].files);
    fmt::print("{:.200}\n", disks[i].told);
  }
  return 0;
}

int run(const std::vector<std::string>& arguments) {
  if (arguments.size() == 2 && arguments[0] == "mark") {
    mark_recording(arguments[1].c_str());
    return 0;
  }
  const bool checks = arguments.size() == 4 && arguments[0] == "check";
  const bool leaves = arguments.size() == 5 && arguments[0] == "leave";
  if (!checks && !leaves) return 2;
  const auto model = model_of(arguments[1], arguments[2]);
  if (!model) {
    fmt::print(stderr, "{}\n", model.error().describe());
    return 1;
  }
  if (checks) return check(*model, arguments[2], arguments[3]);
  return leave(*model, arguments[2], arguments[3], std::stoul(arguments[4]));
}

}  // namespace
}  // namespace plchost

int main(int argc, char** argv) {
  return plchost::run({argv + 1, argv + argc});
}
