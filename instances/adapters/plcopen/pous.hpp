#pragma once

#include <pugixml.hpp>

#include "instances/adapters/plcopen/generated_text.hpp"
#include "instances/adapters/plcopen/project_file.hpp"

namespace plchost::plcopen {

/// <dataType> as TYPE ... END_TYPE.
void add_data_type(ProjectFile& file, const pugi::xml_node& type, GeneratedText& text);

/// <pou> with its interface and its body in ST.
void add_pou(ProjectFile& file, const pugi::xml_node& pou, GeneratedText& text);

}  // namespace plchost::plcopen
