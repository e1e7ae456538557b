#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "shm/base/result.hpp"
#include "shm/files/memory_file.hpp"
#include "shm/variables/variable_type.hpp"

namespace plchost {

inline constexpr std::size_t kMaxVariableName = 250;
inline constexpr std::size_t kMaxVariableArea = 31;
inline constexpr std::size_t kMaxVariables = 65536;
inline constexpr std::size_t kMaxVariableDimensions = 3;
inline constexpr std::uint32_t kMaxVariableBytes = 4096;  ///< of one value: a string's memory
/// Of a variable's array, all dimensions together.
inline constexpr std::uint32_t kMaxVariableElements = 1U << 24U;

/// A dimension of an array, without what only its process knows.
struct VariableDimension {
  std::int32_t first = 0;
  std::uint32_t count = 0;
};

/// A variable of an application as other processes know it.
struct VariableSymbol {
  std::string name;  ///< as declared: "Pump[].speed"
  VariableType type{};
  bool read_only = false;
  std::uint32_t bytes = 0;  ///< of one element
  std::vector<VariableDimension> dimensions;
  std::string task;  ///< the only one that uses it; empty: any
  std::string area;  ///< for people: "%QX0.1"; empty: nowhere

  /// All dimensions together; 1: it is no array.
  [[nodiscard]] std::uint32_t elements() const noexcept;
};

/// "INT", "STRING[80]", "ARRAY [1..10, 0..3] OF INT".
[[nodiscard]] std::string type_text(const VariableSymbol& symbol);
/// "Pump[2].speed": the name of element number `element` (row-major, from 0); of no array: its name.
[[nodiscard]] std::string element_name(const VariableSymbol& symbol, std::uint32_t element);

/// One element of a variable of a table: how processes name a value among themselves.
struct VariableElement {
  std::uint32_t symbol = 0;   ///< number in the table
  std::uint32_t element = 0;  ///< row-major, from 0
  bool operator==(const VariableElement&) const = default;
};

[[nodiscard]] std::string symbol_page_name(std::string_view pool, std::string_view instance);

/// The instance's end: the table of an application's variables, in a shared memory of its own, "POOL.variables.INSTANCE".
/// It never changes: another application, or version, has another page with another stream. Control thread.
class SymbolPage {
 public:
  /// `symbols`: by name, without regard to case, each once; valid. Takes the place of the page of before.
  [[nodiscard]] static Result<SymbolPage> create(std::string_view pool, std::string_view instance,
                                                 std::span<const VariableSymbol> symbols);
  static void remove(std::string_view pool, std::string_view instance) noexcept;
  /// When the table was made (CLOCK_REALTIME, ns), greater than that of the page that it replaced.
  [[nodiscard]] std::uint64_t stream() const noexcept { return stream_; }

 private:
  SymbolPage(MemoryFile memory, std::uint64_t stream) noexcept : memory_(std::move(memory)), stream_(stream) {}
  MemoryFile memory_;
  std::uint64_t stream_ = 0;
};

/// A reader's end, in any process: the table as it was when it was opened, checked and copied, so that no stranger
/// changes it afterwards.
class SymbolTable {
 public:
  /// not_found: the instance has made none. corrupt: not such a page, or its contents contradict each other.
  [[nodiscard]] static Result<SymbolTable> open(std::string_view pool, std::string_view instance);
  /// The same for symbols of this process.
  SymbolTable(std::vector<VariableSymbol> symbols, std::uint64_t stream);

  [[nodiscard]] std::uint64_t stream() const noexcept { return stream_; }
  /// By name, without regard to case.
  [[nodiscard]] std::span<const VariableSymbol> symbols() const noexcept { return symbols_; }

  /// The element that the name means: "Line.speed", "Pump[2].speed", "Grid[1,2]" or "Grid[1][2]". not_found: there is no such
  /// variable; the nearest name is told. invalid_argument: an array without an index, an index out of its range, or
  /// one that is none; says what is allowed.
  [[nodiscard]] Result<VariableElement> find(std::string_view name) const;
  /// Whether `pattern` ('*' any characters, '?' one; without regard to case; "[*]" any index) names this variable, or elements of it. A pattern without
  /// "[" is compared with the name without its "[]", and means all elements.
  struct Match {
    std::uint32_t symbol = 0;
    std::vector<std::uint32_t> elements;  ///< empty: all of them
  };
  /// Those from symbol number `from` on, at most `most` symbols; at most `most_elements` elements named one by one in total.
  [[nodiscard]] std::vector<Match> match(std::string_view pattern, std::uint32_t from = 0,
                                         std::size_t most = kMaxVariables) const;

 private:
  std::vector<VariableSymbol> symbols_;
  std::uint64_t stream_ = 0;
};

}  // namespace plchost
