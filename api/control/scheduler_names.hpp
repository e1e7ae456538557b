#pragma once

#include <array>
#include <string_view>

namespace plchost {

/// The schedulers of this version, for clients: a file is checked and a word is completed without asking a
/// host. A host has the last word: one of another version may know others.
inline constexpr std::array kSchedulerNames = {std::string_view("CmpSchedule"),
                                               std::string_view("CmpScheduleTimer"),
                                               std::string_view("CmpScheduleOneShot")};

}  // namespace plchost
