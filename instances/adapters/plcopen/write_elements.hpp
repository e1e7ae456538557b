#pragma once

#include <set>
#include <string>
#include <string_view>

#include <pugixml.hpp>

namespace plchost::plcopen {

// Parts of an export.

void set(pugi::xml_node element, const char* attribute, const std::string& value);
/// An element with a name.
pugi::xml_node add(pugi::xml_node parent, const char* element, const std::string& name);
/// Behind all other elements in it. Empty: none.
void document(pugi::xml_node element, const std::string& text);

/// Names that ST allows, each once.
class Names {
 public:
  /// The nearest one to `name` that is free.
  [[nodiscard]] std::string of(std::string_view name);

 private:
  std::set<std::string> taken_;
};

/// The words of its documentation, if a name is not written as it is; else empty.
[[nodiscard]] std::string told_name(std::string_view name, std::string_view written);

/// Of a task: the elements of PLCopen know none.
void add_external_event(pugi::xml_node task, const std::string& event);
/// The one that add_external_event() has written; empty: none.
[[nodiscard]] std::string external_event_of(const pugi::xml_node& task);

/// A type in ST, as the element of PLCopen.
void add_type(pugi::xml_node parent, std::string_view type);

}  // namespace plchost::plcopen
