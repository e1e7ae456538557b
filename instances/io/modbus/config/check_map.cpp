#include "instances/io/modbus/config/check_map.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "instances/io/modbus/config/modbus_keys.hpp"
#include "shm/base/names.hpp"

namespace plchost::modbus {

namespace {

std::uint32_t most_of(const RegisterMap& map, MapUse use) {
  switch (use) {
    case MapUse::device_read:
      return is_bit(map.kind) ? kMaxReadBits : kMaxReadRegisters;
    case MapUse::device_write:
      return is_bit(map.kind) ? kMaxWriteBits : kMaxWriteRegisters;
    case MapUse::server:
      break;
  }
  return kRegisterSpace;
}

void check_count(SectionReader& reader, const RegisterMap& map, MapUse use) {
  const std::uint32_t most = most_of(map, use);
  if (map.count > most) {
    reader.problem("count", fmt::format("{} is more than one request has; allowed is 1 to {} of kind {}",
                                        map.count, most, kKindNames[std::to_underlying(map.kind)]));
  } else if (map.address + map.count > kRegisterSpace) {
    reader.problem("count", fmt::format("from address {} there are {} more; {} are asked for", map.address,
                                        kRegisterSpace - map.address, map.count));
  }
  if (map.order != RegisterOrder::single && map.count % 2 != 0) {
    reader.problem("order", fmt::format("makes values of two registers, and count is {}; allowed is an even "
                                        "count",
                                        map.count));
  }
}

void check_kind(SectionReader& reader, const RegisterMap& map, MapUse use) {
  const std::string_view kind = kKindNames[std::to_underlying(map.kind)];
  const bool written = use == MapUse::device_write || map.writable;
  if (written && !is_writable(map.kind)) {
    reader.problem("kind", fmt::format("{} can only be read; allowed are coil, holding_register", kind));
  }
  if (is_bit(map.kind) && map.order != RegisterOrder::single) {
    reader.problem("order", fmt::format("is for registers, and kind is {}; leave it out", kind));
  }
  if (!is_bit(map.kind) && map.bit != 0) {
    reader.problem("bit", fmt::format("is for bits, and kind is {}; leave it out", kind));
  }
}

std::string_view name_of(ImageDirection direction) noexcept {
  switch (direction) {
    case ImageDirection::input:
      return "an input image";
    case ImageDirection::output:
      return "an output image";
    case ImageDirection::memory:
      break;
  }
  return "a memory area";
}

void check_direction(SectionReader& reader, const ImageConfig& image, const RegisterMap& map, MapUse use) {
  const auto refuse = [&](std::string_view why, std::string_view allowed) {
    reader.problem("image", fmt::format("'{}' is {}{}; allowed is an image with direction = {}",
                                        shown(image.name), name_of(image.direction), why, allowed));
  };
  if (image.direction_line == 0) return;  // it was wrong
  if (use == MapUse::device_read && image.direction != ImageDirection::input) {
    refuse(image.direction == ImageDirection::output ? ", which the PLC writes" : "", "\"input\"");
  } else if (use == MapUse::device_write && image.direction != ImageDirection::output) {
    refuse("", "\"output\"");
  } else if (map.writable && image.direction == ImageDirection::output) {
    refuse(": the PLC puts all of its bytes out anew in each cycle", "\"input\" or \"memory\"");
  }
}

}  // namespace

const ImageConfig* find_image(SectionReader& reader, std::string_view key,
                              const std::vector<ImageConfig>& images, const std::string& name) {
  const auto found = std::ranges::find(images, name, &ImageConfig::name);
  if (found != images.end()) return &*found;
  std::vector<std::string_view> names;
  names.reserve(images.size());
  for (const ImageConfig& image : images) {
    if (!image.name.empty()) names.push_back(image.name);  // it was wrong
  }
  reader.problem(key, fmt::format("there is no [[image]] '{}'; there are {}{}", shown(name),
                                  names.empty() ? "none" : join_names(names), suggestion(name, names)));
  return nullptr;
}

void check_map(SectionReader& reader, const std::vector<ImageConfig>& images, const RegisterMap& map,
               MapUse use) {
  if (!reader.wrong("kind")) check_kind(reader, map, use);
  if (!reader.wrong("kind") && !reader.wrong("count")) check_count(reader, map, use);
  if (reader.wrong("image")) return;
  const ImageConfig* const image = find_image(reader, "image", images, map.image);
  if (image == nullptr) return;
  check_direction(reader, *image, map, use);
  if (reader.wrong("kind") || reader.wrong("count") || image->size == 0) return;  // it was wrong
  const std::uint64_t end = first_bit(map) + size_in_bits(map);
  if (end > std::uint64_t{image->size} * 8) {
    reader.problem("offset", fmt::format("the map ends at byte {}, and image '{}' has {}", (end + 7) / 8,
                                         shown(image->name), image->size));
  }
}

}  // namespace plchost::modbus
