#include "api/server/lists/account_names.hpp"

#include <array>
#include <cstddef>
#include <map>

#include <grp.h>
#include <pwd.h>

namespace plchost {

namespace {

constexpr std::size_t kMostAccounts = 256;
using AccountText = std::array<char, 16384>;

template <class LookUp>
const std::string& remembered(std::map<unsigned, std::string>& known, unsigned number,
                              const LookUp& look_up) {
  if (const auto found = known.find(number); found != known.end()) return found->second;
  if (known.size() >= kMostAccounts) known.clear();
  return known[number] = look_up();
}

}  // namespace

const std::string& user_name(uid_t user) {
  static std::map<unsigned, std::string> known;
  return remembered(known, user, [user] {
    AccountText text;
    passwd entry{};
    passwd* found = nullptr;
    const bool got = ::getpwuid_r(user, &entry, text.data(), text.size(), &found) == 0 && found != nullptr;
    return got ? std::string(found->pw_name) : std::string();
  });
}

const std::string& group_name(gid_t number) {
  static std::map<unsigned, std::string> known;
  return remembered(known, number, [number] {
    AccountText text;
    group entry{};
    group* found = nullptr;
    const bool got = ::getgrgid_r(number, &entry, text.data(), text.size(), &found) == 0 && found != nullptr;
    return got ? std::string(found->gr_name) : std::string();
  });
}

}  // namespace plchost
