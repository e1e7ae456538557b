#pragma once

#include <filesystem>
#include <string>

#include <unistd.h>

#include "tests/support/in_a_child.hpp"

namespace plchost {

/// Another user, with the groups of this process, can enter this folder. Of root only.
inline bool can_enter(const std::filesystem::path& folder, uid_t user) {
  return in_a_child([&] {
           const bool can = ::setresuid(user, user, user) == 0 && ::access(folder.c_str(), X_OK) == 0;
           return std::string(can ? "yes" : "no");
         }) == "yes";
}

}  // namespace plchost
