#include "api/cli/verbs/audit_tail.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <ranges>
#include <string_view>
#include <utility>

#include "api/audit/audit_file.hpp"

namespace plchost {

namespace {

constexpr std::uint64_t kMostBytes = std::uint64_t{1} << 20;

// Whole lines of the end of a file, the oldest first.
Result<std::vector<std::string>> last_lines(const std::string& path, std::uint64_t most) {
  std::ifstream file(path, std::ios::binary);
  std::error_code error;
  const std::uint64_t size = std::filesystem::file_size(path, error);
  if (!file || error) return failure(ErrorCode::system, "cannot read " + path, error ? error.value() : errno);
  const std::uint64_t from = size > most ? size - most : 0;
  file.seekg(static_cast<std::streamoff>(from));
  std::vector<std::string> lines;
  for (std::string line; std::getline(file, line);) lines.push_back(line);
  if (from > 0 && !lines.empty()) lines.erase(lines.begin());  // a part of one
  return lines;
}

// Operations without a value of the plant, and records of the log itself.
constexpr std::array<std::string_view, 22> kWithoutValues{"start",
                                                          "stop",
                                                          "reset",
                                                          "restart",
                                                          "single cycle",
                                                          "reset cold",
                                                          "reset statistics",
                                                          "check host",
                                                          "list objects",
                                                          "list nodes",
                                                          "list routes",
                                                          "read clock",
                                                          "load application",
                                                          "set scheduler",
                                                          "register event",
                                                          "unregister event",
                                                          "download application",
                                                          "rollback application",
                                                          "post",
                                                          "begin",
                                                          "repair",
                                                          "gap"};

// Of all others the argument may have one behind its name, and the text tells the one before.
void leave_out_value(Row& record) {
  const std::string what = record.value("what", std::string());
  if (std::ranges::find(kWithoutValues, what) != kWithoutValues.end()) return;
  if (record["argument"].is_string()) {
    const auto argument = record["argument"].get<std::string>();
    record["argument"] = argument.substr(0, argument.find('='));
  }
  record.erase("text");
}

}  // namespace

Result<std::vector<Row>> audit_tail(const std::string& folder, const std::string& instance,
                                    std::size_t most) {
  PLCHOST_TRY_ASSIGN(const auto files, audit_files(folder));
  std::vector<Row> newest;
  const Row of_the_host = "";
  std::uint64_t left = kMostBytes;
  for (const AuditFile& file : files | std::views::reverse) {
    if (left == 0 || newest.size() >= most) break;
    PLCHOST_TRY_ASSIGN(const auto lines, last_lines(file.path, left));
    for (const std::string& line : lines | std::views::reverse) {
      left -= std::min<std::uint64_t>(left, line.size() + 1);
      Row record = Row::parse(line, nullptr, false);
      if (!record.is_object()) continue;
      const Row on = record.value("on", Row());
      if (on != instance && on != of_the_host) continue;
      for (const char* const chain : {"before", "hash"}) record.erase(chain);
      leave_out_value(record);
      newest.push_back(std::move(record));
      if (newest.size() >= most) break;
    }
  }
  std::ranges::reverse(newest);
  return newest;
}

}  // namespace plchost
