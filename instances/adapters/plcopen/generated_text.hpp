#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "instances/adapters/iec/source_place.hpp"

namespace plchost::plcopen {

/// A line of a body.
struct BodyLine {
  std::string text;
  unsigned line = 0;  ///< of the XML file
};

/// A task that an external event runs, for which ST has no words.
struct TaskEvent {
  std::string resource;
  std::string task;
  std::string event;
};

/// ST that is made from XML, and where in the XML each of its lines stands.
class GeneratedText {
 public:
  /// One line; `xml_line` is that of the element that it says.
  void add(std::string_view line, unsigned xml_line);
  void add_body(const std::vector<BodyLine>& lines, const std::string& pou);
  /// The last line of a POU: errors about the end of its body are told there.
  void end_body(std::string_view line);
  void add(TaskEvent event) { events_.push_back(std::move(event)); }

  [[nodiscard]] const std::string& text() const noexcept { return text_; }
  [[nodiscard]] const std::vector<TaskEvent>& events() const noexcept { return events_; }
  /// A problem of this text becomes one of the XML.
  void restore(iec::SourceProblem& problem) const;
  /// The line of the XML on which a line of this text stands, from 1. Of an empty text: the same.
  [[nodiscard]] unsigned line_in_xml(unsigned line) const noexcept;
  /// The first line of a body on that line of the XML, else the first line of this text there. None: the
  /// same.
  [[nodiscard]] unsigned line_of_xml(unsigned xml_line) const noexcept;

 private:
  struct Origin {
    unsigned xml_line = 0;
    unsigned body_line = 0;  // from 1; 0: it is in no body
    std::size_t pou = 0;     // of pous_
  };

  [[nodiscard]] const Origin& origin_of(unsigned line) const noexcept;

  std::string text_;
  std::vector<Origin> origins_;  // of each line
  std::vector<std::string> pous_;
  std::vector<TaskEvent> events_;
};

}  // namespace plchost::plcopen
