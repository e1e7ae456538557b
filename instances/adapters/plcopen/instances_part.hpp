#pragma once

#include <pugixml.hpp>

#include "instances/adapters/plcopen/generated_text.hpp"
#include "instances/adapters/plcopen/project_file.hpp"

namespace plchost::plcopen {

/// <configuration> with its resources, tasks and instances of programs.
void add_configuration(ProjectFile& file, const pugi::xml_node& configuration, GeneratedText& text);

}  // namespace plchost::plcopen
