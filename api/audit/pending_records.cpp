#include "api/audit/pending_records.hpp"

#include <array>
#include <cerrno>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <optional>
#include <utility>

#include <nlohmann/json.hpp>
#include <unistd.h>

namespace plchost {

namespace {

using json = nlohmann::json;

constexpr std::size_t kMostFiles = 4096;

struct Field {
  const char* name;
  std::string AuditRecord::* text;
};
constexpr std::array kFields{Field{"who", &AuditRecord::who}, Field{"from", &AuditRecord::from},
                             Field{"what", &AuditRecord::what}, Field{"on", &AuditRecord::on},
                             Field{"argument", &AuditRecord::argument}};

std::optional<AuditRecord> read(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  const std::string text(std::istreambuf_iterator<char>(file), {});
  const json found = json::parse(text, nullptr, /*allow_exceptions=*/false);
  if (!found.is_object()) return std::nullopt;
  AuditRecord record;
  for (const Field& field : kFields) {
    const auto value = found.find(field.name);
    if (value == found.end() || !value->is_string()) return std::nullopt;
    record.*field.text = value->get<std::string>();
  }
  const auto time = found.find("time_unix_ns");
  if (time == found.end() || !time->is_number_integer()) return std::nullopt;
  record.time_unix_ns = time->get<std::int64_t>();
  return record;
}

}  // namespace

Result<PendingRecords> PendingRecords::open(std::string folder) {
  std::error_code error;
  if (std::filesystem::create_directories(folder, error)) {
    std::filesystem::permissions(folder, std::filesystem::perms::owner_all, error);
  }
  if (error) return failure(ErrorCode::system, "cannot create folder " + folder, error.value());
  return PendingRecords(std::move(folder));
}

std::string PendingRecords::path_of(std::string_view key) const {
  return folder_ + "/" + std::string(key);
}

Result<void> PendingRecords::add(std::string_view key, const AuditRecord& record) const {
  json text{{"time_unix_ns", record.time_unix_ns}};
  for (const Field& field : kFields) text[field.name] = record.*field.text;
  // For a process that is killed, not for a loss of power: that ends what was asked, too.
  std::ofstream file(path_of(key), std::ios::binary | std::ios::trunc);
  file << text.dump(-1, ' ', false, json::error_handler_t::replace) << std::flush;
  if (file) return {};
  return failure(ErrorCode::system, "cannot write " + path_of(key), errno);
}

void PendingRecords::remove(std::string_view key) const {
  (void)::unlink(path_of(key).c_str());
}

std::vector<AuditRecord> PendingRecords::take_all() const {
  std::map<std::filesystem::path, std::optional<AuditRecord>> found;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder_, error)) {
    if (found.size() >= kMostFiles) break;
    if (entry.is_regular_file(error)) found.emplace(entry.path(), read(entry.path()));
  }
  std::vector<AuditRecord> records;
  for (auto& [path, record] : found) {
    if (record) records.push_back(*std::move(record));
    (void)::unlink(path.c_str());
  }
  return records;
}

}  // namespace plchost
