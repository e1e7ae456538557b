#include "api/control/application_order.hpp"

#include <algorithm>
#include <charconv>
#include <filesystem>

#include <fmt/format.h>
#include <unistd.h>

#include "shm/base/names.hpp"

namespace plchost {

namespace {

// Where all shared memories of a pool lie, and never a disk behind it.
constexpr std::string_view kFolder = "/dev/shm";

std::string value_of(const std::map<std::string, std::string>& options, std::string_view name) {
  const auto found = options.find(std::string(name));
  return found == options.end() ? std::string() : found->second;
}

bool read_number(std::string_view text, std::uint64_t& number) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return error == std::errc() && end == text.data() + text.size();
}

bool is_digest(std::string_view text) {
  constexpr std::size_t kDigits = 64;
  return text.size() == kDigits &&
         std::ranges::all_of(text, [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); });
}

}  // namespace

Result<ApplicationOrder> ApplicationOrder::from_options(const std::map<std::string, std::string>& options) {
  ApplicationOrder order;
  const std::string size = value_of(options, kSizeOption);
  if (!read_number(size, order.size) || order.size == 0) {
    return failure(
        ErrorCode::invalid_argument,
        fmt::format("'{}' is '{}'; it is the file's size in bytes, from 1", kSizeOption, shown(size)));
  }
  order.digest = value_of(options, kDigestOption);
  if (!is_digest(order.digest)) {
    return failure(ErrorCode::invalid_argument,
                   fmt::format("'{}' is '{}'; it is the file's SHA-256: 64 lower-case hexadecimal digits",
                               kDigestOption, shown(order.digest)));
  }
  const std::string source = value_of(options, kSourceOption);
  if (!source.empty() && !read_number(source, order.source)) {
    return failure(ErrorCode::invalid_argument,
                   fmt::format("'{}' is '{}'; it is a number", kSourceOption, shown(source)));
  }
  order.by = value_of(options, kByOption);
  order.from = value_of(options, kFromOption);
  order.boot = value_of(options, kBootOption) == kYes;
  return order;
}

Result<void> check_file_name(std::string_view name) {
  const bool good = !name.empty() && name.size() <= kMaxFileName && is_printable_utf8(name) &&
                    name.find('/') == std::string_view::npos;
  if (good) return {};
  return failure(ErrorCode::invalid_argument,
                 fmt::format("'{}' is no name of a file: 1 to {} bytes, no '/'", shown(name), kMaxFileName));
}

std::string download_file_name(std::string_view pool, std::uint64_t number) {
  return fmt::format("{}/{}.download.{}", kFolder, pool, number);
}

void remove_downloads(std::string_view pool) noexcept {
  const std::string begin = fmt::format("{}.download.", pool);
  std::error_code error;
  for (std::filesystem::directory_iterator at(kFolder, error), end; !error && at != end;
       at.increment(error)) {
    if (at->path().filename().string().starts_with(begin)) ::remove(at->path().c_str());
  }
}

}  // namespace plchost
