#include "shm/variables/symbol_page.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <new>

#include <fmt/format.h>

#include "shm/base/names.hpp"
#include "shm/base/time.hpp"
#include "shm/files/fixed_page.hpp"

namespace plchost {

namespace {

/// 1: first.
constexpr PageKind kSymbolPageKind{
    .what = "table of variables", .magic = 0x6d79'7362'6c6f'7631, .version = 1};

struct SymbolPageLayout {
  std::uint64_t magic = 0;  ///< written last
  std::uint32_t version = 0;
  std::uint32_t count = 0;  ///< of records, which follow
  std::uint64_t size = 0;   ///< of the whole page: behind the records are the texts
  std::uint64_t stream = 0;
};

/// Where a text is: bytes from the begin of the texts.
struct TextPlace {
  std::uint32_t offset = 0;
  std::uint32_t bytes = 0;
};

struct SymbolRecord {
  TextPlace name;
  TextPlace task;
  TextPlace area;
  std::uint32_t bytes = 0;
  std::uint8_t type = 0;
  std::uint8_t read_only = 0;
  std::uint16_t dimension_count = 0;
  std::array<VariableDimension, kMaxVariableDimensions> dimensions{};
};
static_assert(sizeof(SymbolPageLayout) == 32 && sizeof(SymbolRecord) == 56);

constexpr std::size_t kMaxTexts = kMaxVariables * (kMaxVariableName + kMaxTaskName + kMaxVariableArea);

constexpr std::size_t texts_offset(std::size_t count) noexcept {
  return sizeof(SymbolPageLayout) + count * sizeof(SymbolRecord);
}

/// The texts of a page: the tasks' names are there once for many.
class Texts {
 public:
  TextPlace add(std::string_view text) {
    if (text.empty()) return {};
    if (text == last_) return last_place_;
    last_place_ = {.offset = static_cast<std::uint32_t>(bytes_.size()),
                   .bytes = static_cast<std::uint32_t>(text.size())};
    last_ = text;
    bytes_ += text;
    return last_place_;
  }
  [[nodiscard]] const std::string& bytes() const noexcept { return bytes_; }

 private:
  std::string bytes_;
  std::string last_;
  TextPlace last_place_;
};

SymbolRecord record_of(const VariableSymbol& symbol, Texts& names, Texts& tasks) {
  SymbolRecord record{.name = names.add(symbol.name),
                      .task = tasks.add(symbol.task),
                      .area = names.add(symbol.area),
                      .bytes = symbol.bytes,
                      .type = std::to_underlying(symbol.type),
                      .read_only = symbol.read_only ? std::uint8_t{1} : std::uint8_t{0},
                      .dimension_count = static_cast<std::uint16_t>(symbol.dimensions.size())};
  std::ranges::copy(symbol.dimensions, record.dimensions.begin());
  return record;
}

// Greater than that of the page that has the name, if that is one.
std::uint64_t next_stream(const std::string& name) {
  const auto now = static_cast<std::uint64_t>(std::max<std::int64_t>(unix_time_ns(), 1));
  const auto before = open_page<SymbolPageLayout>(name, kSymbolPageKind, MemoryFile::Access::read_only);
  if (!before) return now;
  const std::uint64_t stream = reinterpret_cast<const SymbolPageLayout*>(before->bytes().data())->stream;
  return stream < std::numeric_limits<std::int64_t>::max() ? std::max(now, stream + 1) : now;
}

/// The bytes of a page, of which nothing is known.
class Reader {
 public:
  Reader(std::string_view name, std::span<const std::byte> page) : name_(name), page_(page) {
    if (page.size() >= sizeof head_) std::memcpy(&head_, page.data(), sizeof head_);
  }

  Result<SymbolTable> read() const {
    if (!is_described(head_, kSymbolPageKind, page_.size())) return corrupt("its begin is not that of one");
    if (head_.count > kMaxVariables || page_.size() < texts_offset(head_.count))
      return corrupt(fmt::format("it has {} bytes and {} variables", page_.size(), head_.count));
    std::vector<VariableSymbol> symbols;
    symbols.reserve(head_.count);
    for (std::uint32_t i = 0; i < head_.count; ++i) {
      auto symbol = symbol_of(i);
      if (!symbol) return corrupt(fmt::format("variable {}: {}", i, symbol.error().message));
      if (!symbols.empty() && compare_variable_names(symbols.back().name, symbol->name) >= 0)
        return corrupt(fmt::format("variable {} is not in order", i));
      symbols.push_back(*std::move(symbol));
    }
    return SymbolTable(std::move(symbols), head_.stream);
  }

 private:
  [[nodiscard]] std::unexpected<Error> corrupt(const std::string& why) const {
    return failure(ErrorCode::corrupt,
                   fmt::format("shared memory '{}' is not a {}: {}", name_, kSymbolPageKind.what, why));
  }

  [[nodiscard]] Result<std::string> text_of(TextPlace place, std::size_t most) const {
    const auto texts = page_.subspan(texts_offset(head_.count));
    if (place.bytes > most || place.offset > texts.size() || place.bytes > texts.size() - place.offset)
      return failure(ErrorCode::corrupt, "a text is outside of the page");
    return std::string(reinterpret_cast<const char*>(texts.data()) + place.offset, place.bytes);
  }

  [[nodiscard]] Result<VariableSymbol> symbol_of(std::uint32_t index) const {
    SymbolRecord record;
    std::memcpy(&record, page_.data() + texts_offset(index), sizeof record);
    VariableSymbol symbol{.type = static_cast<VariableType>(record.type),
                          .read_only = record.read_only != 0,
                          .bytes = record.bytes};
    PLCHOST_TRY_ASSIGN(symbol.name, text_of(record.name, kMaxVariableName));
    PLCHOST_TRY_ASSIGN(symbol.task, text_of(record.task, kMaxTaskName));
    PLCHOST_TRY_ASSIGN(symbol.area, text_of(record.area, kMaxVariableArea));
    if (record.dimension_count > kMaxVariableDimensions)
      return failure(ErrorCode::corrupt, fmt::format("{} dimensions", record.dimension_count));
    symbol.dimensions.assign(record.dimensions.begin(), record.dimensions.begin() + record.dimension_count);
    PLCHOST_TRY(check_symbol(symbol));
    return symbol;
  }

  std::string_view name_;
  std::span<const std::byte> page_;
  SymbolPageLayout head_;
};

}  // namespace

std::string symbol_page_name(std::string_view pool, std::string_view instance) {
  return fmt::format("{}.variables.{}", pool, instance);
}

Result<SymbolPage> SymbolPage::create(std::string_view pool, std::string_view instance,
                                      std::span<const VariableSymbol> symbols) {
  if (symbols.size() > kMaxVariables) {
    return failure(ErrorCode::full, fmt::format("instance '{}' has {} variables; at most {} are allowed",
                                                instance, symbols.size(), kMaxVariables));
  }
  Texts names;
  Texts tasks;
  std::vector<SymbolRecord> records;
  records.reserve(symbols.size());
  for (const VariableSymbol& symbol : symbols) records.push_back(record_of(symbol, names, tasks));
  for (SymbolRecord& record : records) {
    if (record.task.bytes != 0) record.task.offset += static_cast<std::uint32_t>(names.bytes().size());
  }
  const std::string texts = names.bytes() + tasks.bytes();
  const std::string name = symbol_page_name(pool, instance);
  const std::uint64_t stream = next_stream(name);
  const auto fill = [&](std::span<std::byte> bytes) -> Result<void> {
    auto* const page = new (bytes.data()) SymbolPageLayout;
    page->count = static_cast<std::uint32_t>(records.size());
    page->stream = stream;
    if (!records.empty())
      std::memcpy(bytes.data() + texts_offset(0), records.data(), records.size() * sizeof(SymbolRecord));
    std::memcpy(bytes.data() + texts_offset(records.size()), texts.data(), texts.size());
    describe_page(*page, kSymbolPageKind, bytes.size());
    return {};
  };
  PLCHOST_TRY_ASSIGN(auto memory,
                     MemoryFile::replace(name, texts_offset(records.size()) + texts.size(), fill));
  return SymbolPage(std::move(memory), stream);
}

void SymbolPage::remove(std::string_view pool, std::string_view instance) noexcept {
  MemoryFile::remove(symbol_page_name(pool, instance));
}

Result<SymbolTable> SymbolTable::open(std::string_view pool, std::string_view instance) {
  const std::string name = symbol_page_name(pool, instance);
  PLCHOST_TRY_ASSIGN(const auto memory,
                     open_page<SymbolPageLayout>(name, kSymbolPageKind, MemoryFile::Access::read_only));
  const auto bytes = memory.bytes();
  if (bytes.size() > texts_offset(kMaxVariables) + kMaxTexts) {
    return failure(ErrorCode::corrupt, fmt::format("shared memory '{}' has {} bytes: no {} is that long",
                                                   name, bytes.size(), kSymbolPageKind.what));
  }
  // A copy: its owner may be a stranger, who changes it between check and use.
  const std::vector<std::byte> copy(bytes.begin(), bytes.end());
  return parse(name, copy);
}

Result<SymbolTable> SymbolTable::parse(std::string_view name, std::span<const std::byte> page) {
  return Reader(name, page).read();
}

SymbolTable::SymbolTable(std::vector<VariableSymbol> symbols, std::uint64_t stream)
    : symbols_(std::move(symbols)), stream_(stream) {
  std::ranges::sort(symbols_, [](const VariableSymbol& left, const VariableSymbol& right) {
    return compare_variable_names(left.name, right.name) < 0;
  });
}

}  // namespace plchost
