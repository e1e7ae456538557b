#pragma once

#include <cstddef>
#include <functional>
#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <pugixml.hpp>

#include "instances/adapters/iec/source_place.hpp"

namespace plchost::plcopen {

inline constexpr std::size_t kMostProblems = 100;
/// Of types, values and formatted texts in each other. pugixml itself keeps no stack.
inline constexpr int kMostDepth = 16;

/// A file of PLCopen TC6 XML as it is read, and all that is wrong in it.
class ProjectFile {
 public:
  /// A file that is no such XML: its project() is null, and problems() says why.
  ProjectFile(std::string_view text, std::string name);

  [[nodiscard]] pugi::xml_node project() const noexcept { return project_; }
  /// As PLCopen calls the element: without the prefix of its name space. Others keep theirs.
  [[nodiscard]] std::string_view name_of(const pugi::xml_node& element) const noexcept;
  [[nodiscard]] unsigned line_of(const pugi::xml_node& node) const noexcept;
  /// The lines of the file on which the lines of a text stand. `node`: a text, or a CDATA section.
  [[nodiscard]] std::vector<unsigned> lines_of(const pugi::xml_node& node) const;

  void refuse(const pugi::xml_node& node, std::string text);
  void remark(const pugi::xml_node& node, std::string text);
  [[nodiscard]] const iec::SourceProblems& problems() const noexcept { return problems_; }
  [[nodiscard]] const iec::SourceProblems& remarks() const noexcept { return remarks_; }

  /// The name of something in the program. None, or one that ST does not allow: refused, and empty.
  [[nodiscard]] std::string identifier(const pugi::xml_node& element, const char* attribute,
                                       std::string_view of);

  /// For each name of elements a function that takes one.
  using Handlers =
      std::initializer_list<std::pair<std::string_view, std::function<void(const pugi::xml_node&)>>>;
  /// Goes through the elements in `parent`, which errors call `where`. Documentation is left out. So is what
  /// other tools add, unless it changes the program. Other elements without a handler are refused.
  void read(const pugi::xml_node& parent, std::string_view where, Handlers handlers);

 private:
  void read_added(const pugi::xml_node& data, std::string_view where, Handlers handlers);
  [[nodiscard]] unsigned line_at(std::ptrdiff_t offset) const noexcept;
  void refuse_at(unsigned line, std::string text);
  void load();
  void find_project();

  std::string name_;
  std::string text_;
  std::vector<std::size_t> line_ends_;
  pugi::xml_document document_;
  pugi::xml_node project_;
  std::string prefix_;  // with its colon
  iec::SourceProblems problems_;
  iec::SourceProblems remarks_;
};

/// Whether ST takes it as a name.
[[nodiscard]] bool is_identifier(std::string_view name) noexcept;

}  // namespace plchost::plcopen
