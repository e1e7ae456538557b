#include "instances/runtime/memory/retain_image.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <utility>

#include <fmt/format.h>

#include "instances/runtime/memory/area_record.hpp"
#include "shm/base/names.hpp"

namespace plchost {

namespace {

// "plcretn1", as bytes in the file. Another form of the file gets another number.
constexpr std::uint64_t kMagic = 0x316e746572636c70;

struct FileHeader {
  std::uint64_t magic = kMagic;
  std::uint64_t generation = 0;
  std::int64_t unix_ns = 0;
  std::uint64_t bytes = 0;
  std::uint64_t areas = 0;
  FixedText<kMaxTaskName> application;
  std::array<char, 5> zero{};
};
static_assert(sizeof(FileHeader) == 96);

constexpr std::array<std::uint64_t, 256> kCrcTable = [] {
  constexpr std::uint64_t kPolynomial = 0xc96c5795d7870f42;
  std::array<std::uint64_t, 256> table{};
  for (std::uint64_t byte = 0; byte < table.size(); ++byte) {
    std::uint64_t crc = byte;
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 1U) != 0 ? crc >> 1U ^ kPolynomial : crc >> 1U;
    table[byte] = crc;
  }
  return table;
}();

template <class Part>
void append(std::string& file, const Part& part) {
  file.append(reinterpret_cast<const char*>(&part), sizeof part);
}

// Its size was looked at before.
template <class Part>
Part take(std::string_view& file) {
  Part part;
  std::memcpy(static_cast<void*>(&part), file.data(), sizeof part);
  file.remove_prefix(sizeof part);
  return part;
}

std::unexpected<Error> no_image(std::string_view why) {
  return failure(ErrorCode::corrupt, fmt::format("no whole retain file: {}", why));
}

std::span<const std::byte> bytes_of(std::string_view text) {
  return std::as_bytes(std::span(text.data(), text.size()));
}

}  // namespace

std::uint64_t crc64(std::span<const std::byte> bytes) noexcept {
  std::uint64_t crc = ~std::uint64_t{0};
  for (const std::byte byte : bytes) {
    crc = crc >> 8U ^ kCrcTable[(crc ^ std::to_integer<std::uint64_t>(byte)) & 0xffU];
  }
  return ~crc;
}

Result<void> check_layout(const RetainLayout& layout) {
  if (layout.areas.size() > kMaxRetainAreas || layout.bytes > kMaxRetainBytes) {
    return no_image("more areas or bytes than are allowed");
  }
  std::uint64_t end = 0;
  for (const RetainArea& area : layout.areas) {
    const bool inside = area.offset >= end && area.offset <= layout.bytes &&
                        area.bytes <= layout.bytes - area.offset && area.offset % kRetainAlignment == 0;
    if (!inside) return no_image("an area lies outside of the data, or over another one");
    end = area.offset + area.bytes;
  }
  return {};
}

std::string encode(const RetainImage& image) {
  std::string file;
  file.reserve(sizeof(FileHeader) + image.layout.areas.size() * sizeof(AreaRecord) + image.data.size() +
               sizeof(std::uint64_t));
  append(file, FileHeader{.magic = kMagic,
                          .generation = image.generation,
                          .unix_ns = image.unix_ns,
                          .bytes = image.layout.bytes,
                          .areas = image.layout.areas.size(),
                          .application = FixedText<kMaxTaskName>(image.layout.application)});
  for (const RetainArea& area : image.layout.areas) append(file, record_of(area));
  file.append(reinterpret_cast<const char*>(image.data.data()), image.data.size());
  append(file, crc64(bytes_of(file)));
  return file;
}

Result<RetainImage> decode_retain(std::string_view file) {
  constexpr std::size_t kLeast = sizeof(FileHeader) + sizeof(std::uint64_t);
  if (file.size() < kLeast) return no_image(fmt::format("it has {} bytes", file.size()));
  std::string_view behind = file.substr(file.size() - sizeof(std::uint64_t));
  const auto expected = take<std::uint64_t>(behind);
  const std::string_view checked = file.substr(0, file.size() - sizeof(std::uint64_t));
  if (crc64(bytes_of(checked)) != expected) return no_image("its checksum is wrong");
  // All fields are checked, also if the checksum is right: it may be made on purpose.
  std::string_view rest = checked;
  const auto header = take<FileHeader>(rest);
  if (header.magic != kMagic) return no_image("it is of another kind or version");
  if (header.areas > kMaxRetainAreas || header.bytes > kMaxRetainBytes ||
      rest.size() != header.areas * sizeof(AreaRecord) + header.bytes) {
    return no_image("its size is not what it says");
  }
  if (header.application.bytes.back() != '\0') return no_image("the application's name has no end");
  RetainImage image{.generation = header.generation, .unix_ns = header.unix_ns, .layout = {}, .data = {}};
  image.layout.application = header.application.view();
  image.layout.bytes = header.bytes;
  for (std::uint64_t i = 0; i < header.areas; ++i) {
    auto area = area_of(take<AreaRecord>(rest));
    if (!area) return no_image("an area's name has no end");
    image.layout.areas.push_back(*std::move(area));
  }
  PLCHOST_TRY(check_layout(image.layout));
  const auto data = bytes_of(rest);
  image.data.assign(data.begin(), data.end());
  return image;
}

}  // namespace plchost
