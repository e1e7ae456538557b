#pragma once

/// The properties that Application::variable() in plc_app.hpp takes from the type of a variable.

#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <type_traits>

#include "plc_app.h"

namespace plc {

/// The options of a variable that is seen from outside; see Plc_Variable in plc_variables.h.
struct VariableOptions {
  std::string task = {};   ///< the only one that uses it; empty: any
  std::string area = {};   ///< for people: "%QX0.1"
  bool read_only = false;  ///< a const variable always is
  int first = 0;           ///< index of an array's first element, of each dimension
  unsigned type = 0;  ///< PLC_TYPE_... of the same size, such as PLC_TYPE_WORD; 0: that of its type in C++
};

namespace detail {

/// PLC_TYPE_... of a C++ type; 0: it has none.
template <class T>
constexpr unsigned variable_type() {
  if constexpr (std::is_same_v<T, bool>) return PLC_TYPE_BOOL;
  if constexpr (std::is_same_v<T, float>) return PLC_TYPE_REAL;
  if constexpr (std::is_same_v<T, double>) return PLC_TYPE_LREAL;
  if constexpr (std::is_same_v<T, std::chrono::nanoseconds>) return PLC_TYPE_TIME;
  if constexpr (std::is_same_v<T, char>) return PLC_TYPE_CHAR;
  if constexpr (std::is_same_v<T, char16_t>) return PLC_TYPE_WCHAR;
  if constexpr (std::is_integral_v<T> && !std::is_same_v<T, bool> && !std::is_same_v<T, char> &&
                !std::is_same_v<T, char16_t>) {
    constexpr unsigned kOfSize[] = {0, 0, 1, 0, 2, 0, 0, 0, 3};  // NOLINT(modernize-avoid-c-arrays): C++17
    return (std::is_signed_v<T> ? PLC_TYPE_SINT : PLC_TYPE_USINT) + kOfSize[sizeof(T)];
  }
  return 0;
}

/// Fills in what the type of a variable says; the outermost dimension first.
template <class T>
struct VariableLayout {
  static_assert(variable_type<T>() != 0,
                "a variable is a number, a bool, a character, an array of characters, or an array of these");
  static void fill(Plc_Variable& variable) {
    variable.dwType = variable_type<T>();
    variable.dwBytes = sizeof(T);
  }
};
template <class T>
struct VariableLayout<const T> : VariableLayout<T> {};
template <class T>
struct VariableLayout<std::atomic<T>> : VariableLayout<T> {
  static_assert(sizeof(std::atomic<T>) == sizeof(T) && std::atomic<T>::is_always_lock_free);
};
/// A text, ended by a zero.
template <unsigned Type, std::size_t Bytes>
struct TextLayout {
  static void fill(Plc_Variable& variable) {
    variable.dwType = Type;
    variable.dwBytes = Bytes;
  }
};
template <std::size_t Count>
struct VariableLayout<char[Count]> : TextLayout<PLC_TYPE_STRING, Count> {};
template <std::size_t Count>
struct VariableLayout<char16_t[Count]> : TextLayout<PLC_TYPE_WSTRING, Count * sizeof(char16_t)> {};
template <std::size_t Count>
struct VariableLayout<std::array<char, Count>> : VariableLayout<char[Count]> {};
template <std::size_t Count>
struct VariableLayout<std::array<char16_t, Count>> : VariableLayout<char16_t[Count]> {};
template <class T, std::size_t Count>
struct VariableLayout<T[Count]> {
  static void fill(Plc_Variable& variable) {
    if (variable.nDimensions == PLC_MAX_DIMENSIONS)
      throw std::length_error("an array has too many dimensions");
    Plc_Dimension& dimension = variable.aDimensions[variable.nDimensions++];
    dimension.nCount = Count;
    dimension.dwStride = sizeof(T);
    VariableLayout<T>::fill(variable);
  }
};
template <class T, std::size_t Count>
struct VariableLayout<std::array<T, Count>> : VariableLayout<T[Count]> {};
template <std::size_t Count>
struct VariableLayout<const char[Count]> : VariableLayout<char[Count]> {};
template <std::size_t Count>
struct VariableLayout<const char16_t[Count]> : VariableLayout<char16_t[Count]> {};
template <class T, std::size_t Count>
struct VariableLayout<const T[Count]> : VariableLayout<T[Count]> {};

}  // namespace detail

}  // namespace plc
