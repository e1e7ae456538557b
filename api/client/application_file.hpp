#pragma once

#include <string>
#include <string_view>

#include "shm/base/result.hpp"

namespace plchost {

/// The contents of an application's file of this machine, to be sent. wrong_type: it is no plain file;
/// wrong_size: it is empty, or larger than any host takes; system: it cannot be read. `hint`: added if it
/// cannot be opened.
[[nodiscard]] Result<std::string> read_application(const std::string& path, std::string_view hint = {});

}  // namespace plchost
