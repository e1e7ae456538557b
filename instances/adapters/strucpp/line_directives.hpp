#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "instances/adapters/iec/source_place.hpp"

namespace plchost::strucpp {

/// The name of the file that declares a POU, as the compiler knows the file; nothing: there is no such POU.
using FindFile = std::function<std::optional<std::string>(std::string_view pou)>;

/// The C++ of STruC++, in which each "#line N "FILE"" names the file of its POU, and the line of the user's
/// file. By itself the compiler names its first source in all of them. All lines of the code stay where they
/// are.
[[nodiscard]] std::string with_files_of_pous(std::string_view code, const FindFile& find_file,
                                             const iec::FindLine& find_line);

}  // namespace plchost::strucpp
