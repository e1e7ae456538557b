#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "shm/base/result.hpp"
#include "shm/files/memory_file.hpp"
#include "shm/variables/variable_symbol.hpp"

namespace plchost {

[[nodiscard]] std::string symbol_page_name(std::string_view pool, std::string_view instance);

/// The instance's end: the table of an application's variables, in a shared memory of its own,
/// "POOL.variables.INSTANCE". It never changes: another application, or version, has another page with
/// another stream. Control thread.
class SymbolPage {
 public:
  /// `symbols`: valid, in the order of compare_variable_names(), each name once. Takes the place of the page
  /// of before.
  [[nodiscard]] static Result<SymbolPage> create(std::string_view pool, std::string_view instance,
                                                 std::span<const VariableSymbol> symbols);
  static void remove(std::string_view pool, std::string_view instance) noexcept;
  /// When the table was made (CLOCK_REALTIME, ns), greater than that of the page that it replaced.
  [[nodiscard]] std::uint64_t stream() const noexcept { return stream_; }

 private:
  SymbolPage(MemoryFile memory, std::uint64_t stream) noexcept
      : memory_(std::move(memory)), stream_(stream) {}
  MemoryFile memory_;
  std::uint64_t stream_ = 0;
};

/// A reader's end, in any process: the table as it was when it was opened, checked and copied, so that no
/// stranger changes it afterwards.
class SymbolTable {
 public:
  /// not_found: the instance has made none. corrupt: not such a page, or its contents contradict each other.
  [[nodiscard]] static Result<SymbolTable> open(std::string_view pool, std::string_view instance);
  /// The same of the bytes of a page; `name` is how errors call it.
  [[nodiscard]] static Result<SymbolTable> parse(std::string_view name, std::span<const std::byte> page);
  /// The same for valid symbols of this process, in any order.
  SymbolTable(std::vector<VariableSymbol> symbols, std::uint64_t stream);

  [[nodiscard]] std::uint64_t stream() const noexcept { return stream_; }
  /// In the order of compare_variable_names().
  [[nodiscard]] std::span<const VariableSymbol> symbols() const noexcept { return symbols_; }
  /// Whether there is such an element.
  [[nodiscard]] bool has(VariableElement element) const noexcept {
    return element.symbol < symbols_.size() && element.element < symbols_[element.symbol].elements();
  }

  /// The element that the name means: "Line.speed", "Pump[2].speed", "Grid[1,2]" or "Grid[1][2]". not_found:
  /// there is no such variable; the nearest name is told. invalid_argument: an array without an index, an
  /// index out of its range, or one that is none; says what is allowed.
  [[nodiscard]] Result<VariableElement> find(std::string_view name) const;

  /// A variable that match() has found.
  struct Match {
    std::uint32_t symbol = 0;
    std::vector<std::uint32_t> elements;  ///< ascending; empty: all of them
  };
  /// The variables, or elements of them, that `pattern` names: '*' any characters, '?' one, without regard to
  /// case; "[*]" any index of a dimension. A pattern without "[" is compared with the name without its "[]"
  /// and means all elements. From symbol number `from` on, at most `most` symbols. Of elements that are named
  /// one by one there are at most `most_elements` in all: the search ends with them.
  [[nodiscard]] std::vector<Match> match(std::string_view pattern, std::uint32_t from = 0,
                                         std::size_t most = kMaxVariables,
                                         std::size_t most_elements = kMaxVariables) const;

 private:
  [[nodiscard]] std::vector<VariableSymbol>::const_iterator find_place(std::string_view canonical) const;
  [[nodiscard]] std::unexpected<Error> not_found(std::string_view name, std::string_view canonical) const;

  std::vector<VariableSymbol> symbols_;
  std::uint64_t stream_ = 0;
};

}  // namespace plchost
