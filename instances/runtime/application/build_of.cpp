#include "instances/runtime/application/build_of.hpp"

#include <algorithm>
#include <cstddef>
#include <span>
#include <string_view>

#include <fmt/format.h>

#include "instances/runtime/application/byte_reader.hpp"
#include "shm/base/names.hpp"

namespace plchost {

namespace {

// A note: three sizes and kinds, "GNU", the ID.
std::string build_id(const ElfFile& file) {
  constexpr std::size_t kMost = 256;
  const auto* const section = file.find(".note.gnu.build-id");
  if (section == nullptr) return {};
  const auto bytes = file.read(*section, 0, kMost);
  ByteReader note(bytes);
  const auto name_size = note.number<std::uint32_t>();
  const auto size = note.number<std::uint32_t>();
  (void)note.number<std::uint32_t>();
  constexpr std::uint32_t kAlignment = 4;
  note.skip((std::uint64_t{name_size} + kAlignment - 1) / kAlignment * kAlignment);
  constexpr std::size_t kMostOfAnId = 32;
  std::string id;
  for (std::size_t i = 0; i < std::min<std::size_t>(size, kMostOfAnId) && !note.empty(); ++i)
    id += fmt::format("{:02x}", note.number<std::uint8_t>());
  return id;
}

}  // namespace

std::string build_of(const ElfFile& file) {
  const auto* const comment = file.find(".comment");
  constexpr std::size_t kMost = 150;
  std::string text = comment != nullptr ? printable(shortened(file.text(*comment, 0), kMost)) : std::string();
  const std::string id = build_id(file);
  if (id.empty()) return text;
  return text.empty() ? fmt::format("build ID {}", id) : fmt::format("{}, build ID {}", text, id);
}

std::string build_of(const std::string& path) {
  const auto file = ElfFile::open(path);
  return file ? build_of(*file) : std::string();
}

}  // namespace plchost
