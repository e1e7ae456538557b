#include "api/server/access/identity_watch.hpp"

#include <filesystem>
#include <functional>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <sys/stat.h>

#include "api/security/identity.hpp"

namespace plchost {

namespace {

// The sum of the files' own marks: the order in which a folder tells of them does not matter.
std::uint64_t mark_of_files(const std::string& folder) {
  std::uint64_t sum = 0;
  std::error_code error;
  auto entry = std::filesystem::directory_iterator(folder, error);
  for (; !error && entry != std::filesystem::directory_iterator(); entry.increment(error)) {
    struct stat status{};
    const std::string path = entry->path();
    // A file that is just being written beside the one that it will replace is none yet.
    if (path.ends_with(".new") || ::stat(path.c_str(), &status) != 0 || !S_ISREG(status.st_mode)) continue;
    sum +=
        std::hash<std::string>{}(fmt::format("{} {} {} {}.{} {}", path, status.st_ino, status.st_size,
                                             status.st_mtim.tv_sec, status.st_mtim.tv_nsec, status.st_mode));
  }
  return sum;
}

}  // namespace

IdentityWatch::IdentityWatch(std::string folder) : folder_(std::move(folder)), told_(stamp()), last_(told_) {}

IdentityWatch::Stamp IdentityWatch::stamp() const {
  return {.own = mark_of_files(folder_),
          .known = mark_of_files(security::file_in(folder_, security::kKnownFolder))};
}

IdentityWatch::Change IdentityWatch::look() {
  const Stamp now = stamp();
  const bool quiet = now == std::exchange(last_, now);
  if (!quiet || now == told_) return Change::none;
  const bool own = now.own != told_.own;
  told_ = now;
  return own ? Change::identity : Change::known;
}

}  // namespace plchost
