#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <span>
#include <string>
#include <string_view>

#include <fmt/format.h>

#include "manager/store/instance_wish.hpp"
#include "manager/store/store_order.hpp"
#include "shm/base/crc32c.hpp"
#include "shm/pages/exception_history.hpp"
#include "tests/support/own_name.hpp"

namespace {

using namespace plchost;

void read_order(std::string_view text) {
  const auto order = decode_store_order(text);
  if (!order) {
    if (order.error().code != ErrorCode::corrupt) std::abort();
  } else if (encode(*decode_store_order(encode(*order))) != encode(*order)) {
    std::abort();
  }
}

void read_wish(const std::string& text) {
  const auto wish = decode_wish(text);
  if (!wish) {
    if (wish.error().message.empty()) std::abort();
  } else if (encode(*decode_wish(encode(*wish))) != encode(*wish)) {
    std::abort();
  }
}

void read_history(const std::string& text) {
  static const std::string kPath = own_path("exceptions");
  static const bool kCleans = std::atexit([] { std::filesystem::remove(kPath); }) == 0;
  (void)kCleans;
  std::ofstream(kPath, std::ios::binary | std::ios::trunc) << text;
  const auto history = read_exceptions(kPath);
  if (!history) {
    if (history.error().code != ErrorCode::corrupt) std::abort();
    return;
  }
  if (history->entries.size() > ExceptionHistory::kMaxEntries) std::abort();
  if (!write_exceptions(kPath, *history)) std::abort();
  const auto again = read_exceptions(kPath);
  if (!again || again->count != history->count || again->entries != history->entries) std::abort();
  // As the disk takes what an instance has written, and again.
  ExceptionHistory kept;
  kept.take(*history);
  if (kept.entries.size() > history->entries.size()) std::abort();
  const ExceptionHistory once = kept;
  kept.take(*history);
  if (kept.entries.size() > ExceptionHistory::kMaxEntries || kept.count < once.count) std::abort();
}

}  // namespace

// Files and messages that the manager reads back: an order to its helper, an instance's wanted state and
// exceptions.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace plchost;
  const std::string text(reinterpret_cast<const char*>(data), size);
  read_order(text);
  read_wish(text);
  // It cannot guess a checksum.
  read_wish(fmt::format("{:08x} {}\n", crc32c(std::as_bytes(std::span(text))), text));
  read_history(text);
  return 0;
}
