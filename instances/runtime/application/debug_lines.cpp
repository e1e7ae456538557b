#include "instances/runtime/application/debug_lines.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <string_view>
#include <utility>

#include "instances/runtime/application/byte_reader.hpp"

namespace plchost {

namespace {

constexpr std::uint64_t kMostBytes = std::uint64_t{64} << 20;
constexpr std::uint64_t kMostOfAUnit = std::uint64_t{4} << 20;
constexpr int kMostUnits = 1 << 16;
constexpr std::uint32_t kWide = 0xffff'ffff;  // then the length has 64 bits

// DWARF 5, 6.2.5 and 7.5.6.
enum StandardOpcode : std::uint8_t {
  kExtended = 0,
  kCopy = 1,
  kAdvancePc = 2,
  kAdvanceLine = 3,
  kSetFile = 4,
  kConstAddPc = 8,
  kFixedAdvancePc = 9,
};
enum ExtendedOpcode : std::uint8_t { kEndSequence = 1, kSetAddress = 2 };
enum Form : std::uint16_t {
  kBlock = 0x09,
  kData1 = 0x0b,
  kData2 = 0x05,
  kData4 = 0x06,
  kData8 = 0x07,
  kData16 = 0x1e,
  kUdata = 0x0f,
  kString = 0x08,
  kStrp = 0x0e,
  kLineStrp = 0x1f,
};
constexpr std::uint64_t kPathContent = 1;

/// The part of .debug_line that one compilation has made.
struct Unit {
  std::uint16_t version = 0;
  bool wide = false;
  std::uint8_t instruction = 1;  // bytes
  std::int8_t line_base = 0;
  std::uint8_t line_range = 1;
  std::uint8_t opcode_base = 1;
  std::array<std::uint8_t, 256> operands{};  // of each standard opcode
  ByteReader tables{};                       // of folders and files
  ByteReader program{};
};

std::uint64_t offset_of(ByteReader& bytes, bool wide) {
  return wide ? bytes.number<std::uint64_t>() : bytes.number<std::uint32_t>();
}

// Behind its length. line_range 0: it is none.
Unit unit_of(ByteReader bytes, bool wide) {
  Unit unit{.wide = wide};
  unit.version = bytes.number<std::uint16_t>();
  constexpr std::uint16_t kOldest = 2;
  constexpr std::uint16_t kNewest = 5;
  if (unit.version < kOldest || unit.version > kNewest) return {.line_range = 0};
  if (unit.version >= kNewest) bytes.skip(2);  // the sizes of addresses
  ByteReader header = bytes.part(offset_of(bytes, wide));
  unit.program = bytes;
  unit.instruction = header.number<std::uint8_t>();
  constexpr std::uint16_t kFirstWithBundles = 4;
  if (unit.version >= kFirstWithBundles) header.skip(1);
  header.skip(1);  // whether each line is that of a statement
  unit.line_base = header.number<std::int8_t>();
  unit.line_range = header.number<std::uint8_t>();
  unit.opcode_base = header.number<std::uint8_t>();
  for (unsigned i = 1; i < unit.opcode_base; ++i) unit.operands.at(i) = header.number<std::uint8_t>();
  unit.tables = header;
  if (!header.good()) unit.line_range = 0;
  return unit;
}

/// An address that is looked for.
struct Sought {
  std::uint64_t address = 0;
  std::size_t place = 0;  // among all
};

/// The rows of the table that a unit's program makes, each up to the address of the next one.
class Rows {
 public:
  Rows(const Unit& unit, std::span<const Sought> sought, std::vector<SourceLine>& lines)
      : unit_(unit), sought_(sought), lines_(lines) {}

  /// The lines that are found, each with the number of its file.
  std::vector<std::pair<std::size_t, std::uint64_t>> run() {
    ByteReader program = unit_.program;
    while (!program.empty()) step(program);
    return std::move(files_);
  }

 private:
  void step(ByteReader& program) {
    const auto opcode = program.number<std::uint8_t>();
    if (opcode >= unit_.opcode_base) {
      const unsigned special = opcode - unit_.opcode_base;
      advance(special / unit_.line_range);
      line_ += static_cast<std::uint64_t>(std::int64_t{unit_.line_base} + special % unit_.line_range);
      return row();
    }
    switch (opcode) {
      case kExtended:
        return extended(program.part(program.unsigned_leb()));
      case kCopy:
        return row();
      case kAdvancePc:
        return advance(program.unsigned_leb());
      case kAdvanceLine:
        line_ += static_cast<std::uint64_t>(program.signed_leb());
        return;
      case kSetFile:
        file_ = program.unsigned_leb();
        return;
      case kConstAddPc: {
        constexpr unsigned kLastOpcode = 255;
        return advance((kLastOpcode - unit_.opcode_base) / unit_.line_range);
      }
      case kFixedAdvancePc:
        address_ += program.number<std::uint16_t>();
        return;
      default:
        for (unsigned i = 0; i < unit_.operands.at(opcode); ++i) (void)program.unsigned_leb();
    }
  }

  void extended(ByteReader operation) {
    const auto opcode = operation.number<std::uint8_t>();
    if (opcode == kSetAddress) address_ = operation.number<std::uint64_t>();
    if (opcode != kEndSequence) return;
    row();
    address_ = 0;
    begun_ = false;
    file_ = line_ = 1;
  }

  void advance(std::uint64_t operations) noexcept { address_ += operations * unit_.instruction; }

  // A linker that leaves a function out lets its rows begin at 0, where no code is.
  void row() {
    if (begun_ && first_ != 0 && address_ > before_.address && before_.line != 0) find(before_);
    if (!begun_) first_ = address_;
    begun_ = true;
    before_ = {.address = address_, .file = file_, .line = line_};
  }

  struct Row {
    std::uint64_t address = 0;
    std::uint64_t file = 0;
    std::uint64_t line = 0;
  };
  void find(const Row& row) {
    auto at = std::ranges::lower_bound(sought_, row.address, {}, &Sought::address);
    for (; at != sought_.end() && at->address < address_; ++at) {
      if (lines_[at->place].line != 0) continue;
      lines_[at->place].line = row.line;
      files_.emplace_back(at->place, row.file);
    }
  }

  const Unit& unit_;
  std::span<const Sought> sought_;
  std::vector<SourceLine>& lines_;
  std::vector<std::pair<std::size_t, std::uint64_t>> files_;
  std::uint64_t address_ = 0;
  std::uint64_t file_ = 1;
  std::uint64_t line_ = 1;
  std::uint64_t first_ = 0;  // address of the sequence
  bool begun_ = false;       // the sequence has a row
  Row before_;
};

std::string last_part(std::string_view path) {
  return std::string(path.substr(path.find_last_of('/') + 1));
}

/// The names of the files of a unit, as far as they are asked for.
class FileNames {
 public:
  FileNames(const ElfFile& file, const Unit& unit) : file_(file), unit_(unit) {}

  std::string at(std::uint64_t number) {
    ByteReader tables = unit_.tables;
    constexpr std::uint16_t kFirstWithFormats = 5;
    if (unit_.version >= kFirstWithFormats) {
      skip_table(tables);
      return in_table(tables, number);
    }
    while (tables.good() && !tables.text().empty()) continue;  // folders
    return in_list(tables, number);
  }

 private:
  struct Format {
    std::uint64_t content = 0;
    std::uint64_t form = 0;
  };

  static std::string in_list(ByteReader& list, std::uint64_t number) {
    for (std::uint64_t i = 1; list.good(); ++i) {  // numbers begin at 1
      const std::string_view name = list.text();
      if (name.empty() || i == number) return last_part(name);
      for (int folder_time_and_size = 0; folder_time_and_size < 3; ++folder_time_and_size)
        (void)list.unsigned_leb();
    }
    return {};
  }

  static std::vector<Format> formats(ByteReader& table) {
    std::vector<Format> formats(table.number<std::uint8_t>());
    for (Format& format : formats) {
      format.content = table.unsigned_leb();
      format.form = table.unsigned_leb();
    }
    return formats;
  }

  void skip_table(ByteReader& table) const {
    const auto entry = formats(table);
    const std::uint64_t count = entry.empty() ? (void)table.unsigned_leb(), 0 : table.unsigned_leb();
    for (std::uint64_t i = 0; i < count && table.good(); ++i) (void)path_of(table, entry, false);
  }

  std::string in_table(ByteReader& table, std::uint64_t number) const {
    const auto entry = formats(table);
    const std::uint64_t count = table.unsigned_leb();
    if (entry.empty()) return {};
    for (std::uint64_t i = 0; i < count && table.good(); ++i) {
      const std::string path = path_of(table, entry, i == number);
      if (i == number) return last_part(path);
    }
    return {};
  }

  std::string path_of(ByteReader& table, std::span<const Format> entry, bool wanted) const {
    std::string path;
    for (const Format& format : entry) {
      std::string value = value_of(table, format.form, wanted && format.content == kPathContent);
      if (format.content == kPathContent) path = std::move(value);
    }
    return path;
  }

  std::string value_of(ByteReader& table, std::uint64_t form, bool wanted) const {
    switch (form) {
      case kString:
        return std::string(table.text());
      case kLineStrp:
      case kStrp: {
        const std::uint64_t from = offset_of(table, unit_.wide);
        const auto* const texts =
            wanted ? file_.find(form == kStrp ? ".debug_str" : ".debug_line_str") : nullptr;
        return texts != nullptr ? file_.text(*texts, from) : std::string();
      }
      case kUdata:
        (void)table.unsigned_leb();
        return {};
      case kBlock:
        table.skip(table.unsigned_leb());
        return {};
      default:
        table.skip(size_of(form));
        return {};
    }
  }

  // A form that is not known ends the table: nobody knows where its next entry begins.
  static std::uint64_t size_of(std::uint64_t form) noexcept {
    constexpr std::array kSizes{std::pair{kData1, 1}, std::pair{kData2, 2}, std::pair{kData4, 4},
                                std::pair{kData8, 8}, std::pair{kData16, 16}};
    const auto* const known =
        std::ranges::find_if(kSizes, [form](const auto& each) { return each.first == form; });
    return known == kSizes.end() ? ~std::uint64_t{0} : static_cast<std::uint64_t>(known->second);
  }

  const ElfFile& file_;
  const Unit& unit_;
};

void look_at(const ElfFile& file, const Unit& unit, std::span<const Sought> sought,
             std::vector<SourceLine>& lines) {
  if (unit.line_range == 0) return;
  FileNames names(file, unit);
  for (const auto& [place, number] : Rows(unit, sought, lines).run()) lines[place].file = names.at(number);
}

}  // namespace

std::vector<SourceLine> source_lines(const ElfFile& file, std::span<const std::uint64_t> addresses,
                                     TimePoint deadline) {
  std::vector<SourceLine> lines(addresses.size());
  const ElfFile::Section* const section = file.find(".debug_line");
  if (section == nullptr) return lines;
  std::vector<Sought> sought;
  for (std::size_t i = 0; i < addresses.size(); ++i) sought.push_back({.address = addresses[i], .place = i});
  std::ranges::sort(sought, {}, &Sought::address);
  const std::uint64_t end = std::min(section->size, kMostBytes);
  std::uint64_t at = 0;
  for (int units = 0; at < end && units < kMostUnits && MonotonicClock::now() < deadline; ++units) {
    constexpr std::size_t kLengths = 12;
    const auto head = file.read(*section, at, kLengths);
    ByteReader lengths(head);
    const auto narrow = lengths.number<std::uint32_t>();
    const bool wide = narrow == kWide;
    const std::uint64_t length = wide ? lengths.number<std::uint64_t>() : narrow;
    if (!lengths.good()) break;
    at += head.size() - lengths.size();
    if (length > section->size - at) break;
    if (length <= kMostOfAUnit) {
      const auto bytes = file.read(*section, at, length);
      look_at(file, unit_of(ByteReader(bytes), wide), sought, lines);
    }
    at += length;
  }
  return lines;
}

}  // namespace plchost
