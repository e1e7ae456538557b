#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "shm/base/result.hpp"
#include "shm/variables/indexed_name.hpp"

namespace plchost {

/// An array whose elements a debugger's client asks for one by one.
class ExpandedArray {
 public:
  /// Of a variable as a host tells it: "Main.t[]", "ARRAY [1..2] OF INT". Nothing: it is no array.
  [[nodiscard]] static std::optional<ExpandedArray> of(std::string_view name, std::string_view type);

  [[nodiscard]] const std::string& name() const noexcept { return name_; }
  [[nodiscard]] std::uint64_t elements() const noexcept { return elements_; }
  /// The whole name of element `number`, row-major, from 0: "Main.t[1]".
  [[nodiscard]] std::string element(std::uint64_t number) const;
  [[nodiscard]] const std::string& element_type() const noexcept { return element_type_; }
  /// The number of the element of such a name. invalid_argument: it names none; says what is allowed.
  [[nodiscard]] Result<std::uint64_t> number(const IndexedName& element) const;
  /// The part of such a name from its first bracket on: "[1]".
  [[nodiscard]] std::string label(std::string_view element) const {
    return std::string(element.substr(name_.find('[')));
  }
  /// The whole name that has this label.
  [[nodiscard]] std::string labelled(std::string_view label) const {
    return name_.substr(0, name_.find('[')).append(label);
  }
  bool operator==(const ExpandedArray&) const = default;

 private:
  struct Dimension {
    std::int64_t first = 0;
    std::uint64_t count = 0;
    bool operator==(const Dimension&) const = default;
  };
  std::string name_;
  std::string element_type_;
  std::vector<Dimension> dimensions_;
  std::uint64_t elements_ = 1;
};

}  // namespace plchost
