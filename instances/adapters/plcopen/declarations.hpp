#pragma once

#include <string>
#include <string_view>

#include <pugixml.hpp>

#include "instances/adapters/plcopen/generated_text.hpp"
#include "instances/adapters/plcopen/project_file.hpp"

namespace plchost::plcopen {

// Elements of PLCopen XML, in the words of ST. All that cannot be said is refused, under the name `where`.

/// Of <type>, <baseType> and <returnType>: "ARRAY[1..3] OF INT". Empty: refused.
[[nodiscard]] std::string type_in(ProjectFile& file, const pugi::xml_node& parent, std::string_view where,
                                  int depth = 0);

/// Of <initialValue>, for a variable whose type is in `type`. Empty: refused.
[[nodiscard]] std::string value_in(ProjectFile& file, const pugi::xml_node& parent,
                                   const pugi::xml_node& type, std::string_view where);

/// "count AT %QW1 : INT := 5;" Empty: refused.
[[nodiscard]] std::string declaration_of(ProjectFile& file, const pugi::xml_node& variable,
                                         std::string_view where, int depth = 0);

/// A section with its variables: VAR_INPUT RETAIN ... END_VAR. Without variables nothing.
void add_section(ProjectFile& file, const pugi::xml_node& list, std::string_view keyword,
                 std::string_view where, GeneratedText& text);

/// Whether it is the name of an elementary type other than the texts, in upper case.
[[nodiscard]] bool is_elementary(std::string_view type) noexcept;

/// An attribute of XML's type boolean.
[[nodiscard]] bool is_true(const pugi::xml_node& element, const char* attribute);

}  // namespace plchost::plcopen
