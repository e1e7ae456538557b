#include "api/audit/audit_file.hpp"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <filesystem>
#include <string_view>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include "shm/base/system_call.hpp"
#include "shm/base/unique_fd.hpp"

namespace plchost {

namespace {

constexpr std::string_view kPrefix = "audit.";
constexpr std::string_view kSuffix = ".log";

// `is_all`: the text begins where the file does. Else its first line may be the end of one.
AuditEnd end_of(std::string_view text, bool is_all) {
  AuditEnd end;
  if (text.empty()) return end;
  end.last_line_is_whole = text.back() == '\n';
  if (end.last_line_is_whole) text.remove_suffix(1);
  for (;;) {
    const std::size_t before = text.rfind('\n');
    if (before == std::string_view::npos && !is_all) return end;
    // A record whose newline alone is missing is whole.
    if (const auto link = read_link(text.substr(before + 1))) {  // npos + 1: the first line
      end.head = AuditHead{.number = link->number, .hash = link->hash};
      return end;
    }
    end.head_is_last = false;
    if (before == std::string_view::npos) return end;
    text = text.substr(0, before);
  }
}

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

// From its end, in stretches that become longer: a power cut may have left more there than a record has.
Result<AuditEnd> read_end(const std::string& path) {
  constexpr std::size_t kFirst = std::size_t{64} << 10;
  const UniqueFd file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW));
  if (!file) return failure(ErrorCode::system, "cannot open " + path, errno);
  struct stat status{};
  PLCHOST_TRY(check_errno(::fstat(file.get(), &status), "cannot examine " + path));
  const auto size = static_cast<std::size_t>(status.st_size);
  for (std::size_t length = std::min(kFirst, size);; length = std::min(2 * length, size)) {
    std::string tail(length, '\0');
    PLCHOST_TRY_ASSIGN(const auto got, check_errno(::pread(file.get(), tail.data(), length,
                                                           static_cast<off_t>(size - length)),
                                                   "cannot read " + path));
    tail.resize(static_cast<std::size_t>(got));
    AuditEnd end = end_of(tail, length == size);
    if (end.head || length == size) return end;
  }
}

}  // namespace plchost
