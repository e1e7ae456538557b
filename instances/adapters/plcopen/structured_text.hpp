#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "instances/adapters/iec/compiler.hpp"
#include "instances/adapters/iec/project.hpp"
#include "instances/adapters/iec/source_place.hpp"
#include "instances/adapters/plcopen/generated_text.hpp"

namespace plchost::plcopen {

inline constexpr std::size_t kMostPrograms = 1024;  ///< instances in a resource

/// A project of PLCopen XML in ST. It has the file's name, and lines of its own.
struct StructuredText {
  GeneratedText text;
  iec::SourceProblems problems;  ///< if there are any, the text is not whole
  iec::SourceProblems remarks;   ///< these and the problems have places in the XML
};

/// Whether the build reads this file as PLCopen XML.
[[nodiscard]] bool is_project_file(std::string_view name);

/// Reads PLCopen TC6 XML 2.01, and 2.0 as CODESYS writes it. Any text, hostile ones included: bounded depth,
/// no entities, no other files.
[[nodiscard]] StructuredText structured_text_of(const iec::Source& xml);

/// The sources of a build that are PLCopen XML.
class ProjectSources {
 public:
  /// Its ST, under the same name. All problems in it come to `problems`.
  [[nodiscard]] iec::Source take(const iec::Source& xml, iec::SourceProblems& problems);
  /// The lengths of texts become those that the compiler knows, in those of `sources` that are XML. MATIEC
  /// takes none in arrays and structures, and no text with one in its functions.
  void fit_lengths(std::vector<iec::Source>& sources, iec::Compiler compiler);
  /// The external events of tasks come to those to which a task file gives none.
  void add_events(iec::Configuration& configuration) const;
  /// Problems and remarks of the ST get their places in the XML. The remarks of all XML come to the others.
  void restore(iec::SourceProblems& problems, iec::SourceProblems& remarks) const;
  /// The line of the file on which a line of its source stands. Of ST it is the same.
  [[nodiscard]] unsigned line_in_file(std::string_view file, unsigned line) const noexcept;
  /// A line of the source that stands on that line of the file: the first one in a body, if there is one.
  [[nodiscard]] unsigned line_in_source(std::string_view file, unsigned line) const noexcept;

 private:
  [[nodiscard]] const GeneratedText* text_of(std::string_view file) const noexcept;

  std::vector<std::pair<std::string, GeneratedText>> texts_;  // by the name of the file
  iec::SourceProblems remarks_;
};

}  // namespace plchost::plcopen
