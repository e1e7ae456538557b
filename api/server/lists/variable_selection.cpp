#include "api/server/lists/variable_selection.hpp"

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <map>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "api/dds/text.hpp"
#include "shm/base/names.hpp"
#include "shm/variables/indexed_name.hpp"
#include "shm/variables/variable_type.hpp"

namespace plchost {

namespace {

// A page is one sample: of at most 256 KiB, with some room for what DDS adds.
constexpr std::size_t kMostPageBytes = 200'000;
// Of a row beside its texts.
constexpr std::size_t kRowBytes = 64;
constexpr std::size_t kMostValueText = sizeof(plc_VariableRecord::value) - 1;

// A page goes on behind a row: `after` is that of the row, from 1.
constexpr unsigned kElementBits = 25;
static_assert(kMaxVariableElements < (1U << kElementBits));
std::uint64_t place_of(std::uint32_t symbol, std::optional<std::uint32_t> element) {
  return (std::uint64_t{symbol} << kElementBits | (element ? *element + 1 : 0)) + 1;
}

bool has_wildcard(std::string_view pattern) {
  return pattern.find_first_of("*?") != std::string_view::npos;
}

Result<void> check_wildcards(const VariableQuery& query) {
  if (std::ranges::count_if(query.patterns, has_wildcard) <= std::ptrdiff_t{kMaxWildcards}) return {};
  return failure(ErrorCode::invalid_argument,
                 fmt::format("more than {} patterns with '*' or '?' in one request", kMaxWildcards));
}

// The rows of the table that a query names, each once, in their order.
using Chosen = std::map<std::uint64_t, SelectedVariable>;

/// False: neither this row nor one behind it has room on the page.
bool choose(Chosen& chosen, std::uint32_t symbol, std::optional<std::uint32_t> element, std::uint64_t after) {
  const std::uint64_t place = place_of(symbol, element);
  if (place <= after) return true;
  chosen.try_emplace(place, SelectedVariable{.symbol = symbol, .element = element});
  // More than a page has room for is not looked at in this one.
  if (chosen.size() <= kPageVariables + 1) return true;
  const auto last = std::prev(chosen.end());
  const bool has_room = last->first != place;
  chosen.erase(last);
  return has_room;
}

void choose_all(Chosen& chosen, const SymbolTable& table, std::uint64_t after) {
  const auto first = static_cast<std::uint32_t>(after == 0 ? 0 : (after - 1) >> kElementBits);
  for (std::size_t i = first; i < table.symbols().size() && chosen.size() <= kPageVariables; ++i) {
    choose(chosen, static_cast<std::uint32_t>(i), std::nullopt, after);
  }
}

void choose_like(Chosen& chosen, const SymbolTable& table, const std::string& pattern, std::uint64_t after) {
  const bool by_index = pattern.contains('[');
  for (const SymbolTable::Match& match : table.match(pattern)) {
    if (!by_index) {
      choose(chosen, match.symbol, std::nullopt, after);
    } else if (match.elements.empty()) {  // all of them, one by one
      const std::uint32_t count = table.symbols()[match.symbol].elements();
      for (std::uint32_t element = 0; element < count; ++element) {
        if (!choose(chosen, match.symbol, element, after)) break;
      }
    } else {
      for (const std::uint32_t element : match.elements) choose(chosen, match.symbol, element, after);
    }
  }
}

// Of a whole array those elements are shown that lie in so many bytes. So an empty page has room for each
// row, and each row shows a value.
constexpr std::size_t kShownArrayBytes = 16'384;
static_assert(kMaxVariableBytes <= kShownArrayBytes && kShownArrayBytes <= kMaxValueBytes);
static_assert(kShownElements <= kMaxRequestedValues);

std::size_t shown_elements(const VariableSymbol& symbol) {
  const std::size_t most = std::min<std::size_t>(kShownElements, kShownArrayBytes / symbol.bytes);
  return std::min<std::size_t>(symbol.elements(), most);
}

// Adds up what a page holds.
class Page {
 public:
  explicit Page(const SymbolTable& table) : table_(table) {}

  // False: it has no room for this row.
  bool add(SelectedVariable row) {
    const VariableSymbol& symbol = table_.symbols()[row.symbol];
    row.first = selection_.elements.size();
    row.count = row.element ? 1 : shown_elements(symbol);
    const std::size_t values = row.count * symbol.bytes;
    // A byte of a string has up to three characters.
    const std::size_t text = std::min(kMostValueText, std::max<std::size_t>(values * 3, 40));
    // A whole array has no one value that it is forced to.
    const std::size_t texts = row.element || symbol.dimensions.empty() ? 2 : 1;
    const std::size_t bytes =
        kRowBytes + symbol.name.size() + symbol.task.size() + symbol.area.size() + texts * text + 80;
    if (selection_.rows.size() == kPageVariables || bytes_ + bytes > kMostPageBytes ||
        row.first + row.count > kMaxRequestedValues || values_ + values > kMaxValueBytes) {
      return false;
    }
    for (std::uint32_t i = 0; i < row.count; ++i) {
      selection_.elements.push_back({.symbol = row.symbol, .element = row.element.value_or(i)});
    }
    bytes_ += bytes;
    values_ += values;
    selection_.next_after = place_of(row.symbol, row.element);
    selection_.rows.push_back(row);
    return true;
  }

  VariableSelection take(const Chosen& chosen) {
    for (const auto& [place, row] : chosen) {
      if (add(row)) continue;
      selection_.complete = false;
      break;
    }
    return std::move(selection_);
  }

 private:
  const SymbolTable& table_;
  VariableSelection selection_;
  std::size_t bytes_ = 0;
  std::size_t values_ = 0;
};

// The bytes of each value of a reply, one after the other.
class Values {
 public:
  Values(const SymbolTable& table, const ValueReply& reply) {
    std::size_t at = 0;
    for (const VariableElement& element : reply.elements) {
      if (element.symbol >= table.symbols().size()) break;
      const std::size_t bytes = table.symbols()[element.symbol].bytes;
      if (at + bytes > reply.values.size()) break;
      all_.push_back(std::span(reply.values).subspan(at, bytes));
      at += bytes;
    }
  }
  // Empty: there is none.
  [[nodiscard]] std::span<const std::byte> of(std::size_t index) const {
    return index < all_.size() ? all_[index] : std::span<const std::byte>();
  }

 private:
  std::vector<std::span<const std::byte>> all_;
};

std::string array_text(const VariableSymbol& symbol, const SelectedVariable& row, const Values& values) {
  std::string text = "[";
  for (std::size_t i = 0; i < row.count; ++i) {
    if (i > 0) text += ", ";
    text += variable_text(symbol.type, values.of(row.first + i), kMostValueText);
    if (text.size() > kMostValueText) break;
  }
  const bool all = row.count == symbol.elements() && text.size() < kMostValueText;
  if (all) return text + "]";
  constexpr std::string_view kMore = "...";
  return std::string(cut(text, kMostValueText - kMore.size())).append(kMore);
}

// The type of a row: that of an element is not that of its array.
std::string type_of(const VariableSymbol& symbol, const SelectedVariable& row) {
  if (!row.element) return type_text(symbol);
  VariableSymbol element = symbol;
  element.dimensions.clear();
  return type_text(element);
}

}  // namespace

Result<VariableSelection> select_variables(const SymbolTable& table, const VariableQuery& query) {
  Chosen chosen;
  if (query.patterns.empty()) choose_all(chosen, table, query.after);
  PLCHOST_TRY(check_wildcards(query));
  for (const std::string& pattern : query.patterns) {
    if (has_wildcard(pattern)) {
      PLCHOST_TRY(IndexedName::parse(pattern));
      choose_like(chosen, table, pattern, query.after);
      continue;
    }
    const bool indexed = pattern.find('[') != std::string::npos;
    const auto found = table.find(pattern);
    if (found) {
      choose(chosen, found->symbol, indexed ? std::optional(found->element) : std::nullopt, query.after);
    } else if (indexed || found.error().code == ErrorCode::not_found) {
      return std::unexpected(found.error());
    } else {
      choose_like(chosen, table, pattern, query.after);  // a whole array
    }
  }
  return Page(table).take(chosen);
}

Result<VariableSelection> select_forced(const SymbolTable& table, const VariableQuery& query,
                                        std::span<const VariableElement> forced) {
  PLCHOST_TRY(check_wildcards(query));
  std::vector<SymbolTable::Match> named;
  for (const std::string& pattern : query.patterns)
    std::ranges::move(table.match(pattern), std::back_inserter(named));
  const auto is_named = [&](const VariableElement& element) {
    return query.patterns.empty() || std::ranges::any_of(named, [&](const SymbolTable::Match& match) {
             return match.symbol == element.symbol &&
                    (match.elements.empty() ||
                     std::ranges::find(match.elements, element.element) != match.elements.end());
           });
  };
  Chosen chosen;
  for (const VariableElement& element : forced) {
    if (element.symbol < table.symbols().size() && is_named(element)) {
      const bool is_array = !table.symbols()[element.symbol].dimensions.empty();
      choose(chosen, element.symbol, is_array ? std::optional(element.element) : std::nullopt, query.after);
    }
  }
  return Page(table).take(chosen);
}

std::vector<plc_VariableRecord> records_of(const SymbolTable& table, const VariableSelection& selection,
                                           const ValueReply& current, const ValueReply& forced) {
  const Values values(table, current);
  const Values forced_values(table, forced);
  std::vector<plc_VariableRecord> records;
  records.reserve(selection.rows.size());
  for (const SelectedVariable& row : selection.rows) {
    const VariableSymbol& symbol = table.symbols()[row.symbol];
    const bool is_one = row.element.has_value() || symbol.dimensions.empty();
    plc_VariableRecord record{};
    dds::copy_text(record.name, row.element ? element_name(symbol, *row.element) : symbol.name);
    dds::copy_text(record.type, type_of(symbol, row));
    dds::copy_text(record.task, symbol.task);
    dds::copy_text(record.area, symbol.area);
    record.read_only = symbol.read_only;
    dds::copy_text(record.value, is_one ? variable_text(symbol.type, values.of(row.first), kMostValueText)
                                        : array_text(symbol, row, values));
    for (std::size_t i = 0; i < forced.elements.size(); ++i) {
      const VariableElement& element = forced.elements[i];
      if (element.symbol != row.symbol || (is_one && element.element != row.element.value_or(0))) continue;
      record.forced = true;
      if (is_one)
        dds::copy_text(record.forced_value, variable_text(symbol.type, forced_values.of(i), kMostValueText));
    }
    records.push_back(record);
  }
  return records;
}

}  // namespace plchost
