#include "api/cli/verbs/security_verbs.hpp"

#include <array>
#include <ctime>
#include <memory>

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <unistd.h>

#include "api/security/identity.hpp"
#include "api/security/security_folder.hpp"
#include "shm/base/names.hpp"

namespace plchost {

namespace {

using security::IdentityView;
using security::SecurityFolder;

constexpr std::time_t kDay = 86'400;

/// The options behind the words, shared by the actions.
struct Said {
  std::string directory = "/etc/plchost/security";
  std::string new_directory;  // of init: no variable of the environment stands for it
  std::string first_host;     // of init
  std::string role;
  std::string name;
  std::int64_t days = security::kDaysOfIdentity;
};

int finish(const Result<void>& done, const std::string& remark) {
  if (!done) return CliSession::fail(done.error());
  fmt::print("{}\n", remark);
  return kExitDone;
}

/// Opens the folder and does something with it.
template <class Action>
int with_folder(const Said& said, Action action) {
  auto folder = SecurityFolder::open(said.directory);
  if (!folder) return CliSession::fail(folder.error());
  return action(*folder);
}

std::string this_machine() {
  std::array<char, 65> name{};
  (void)::gethostname(name.data(), name.size() - 1);
  return name.data();
}

int init(const std::string& directory, const std::string& said_host) {
  const std::string host = said_host.empty() ? this_machine() : said_host;
  return finish(
      SecurityFolder::init(directory, host),
      fmt::format("{0}/{1}: the identity of host '{1}', for its [dds] identity\n{0}/authorities: keep it "
                  "where no controller and no client is",
                  directory, host));
}

int add_identity(const Said& said) {
  const auto role = security::parse_role(said.role);
  if (!role) return CliSession::fail(role.error());
  return with_folder(said, [&](SecurityFolder& folder) {
    return finish(folder.add(*role, said.name, static_cast<int>(said.days)),
                  fmt::format("{}/{}: identity '{}', {}, for {}", said.directory, said.name, said.name,
                              said.role, count_text(static_cast<std::uint64_t>(said.days), "day")));
  });
}

int renew(const Said& said) {
  return with_folder(said, [&](SecurityFolder& folder) {
    return finish(folder.renew(said.name, static_cast<int>(said.days)),
                  fmt::format("{}/{}: renewed, for {}", said.directory, said.name,
                              count_text(static_cast<std::uint64_t>(said.days), "day")));
  });
}

int revoke(const Said& said) {
  return with_folder(said, [&](SecurityFolder& folder) {
    return finish(
        folder.revoke(said.name),
        fmt::format("'{}' is revoked in all folders of {}; bring copies of them up to date, of hosts "
                    "first",
                    said.name, said.directory));
  });
}

std::string state_of(const IdentityView& identity, std::time_t now) {
  if (identity.revoked) return "revoked";
  if (identity.validity.not_after < now) return "expired";
  if (identity.validity.not_before > now) return "not yet valid";
  return identity.validity.not_after - now < security::kExpiresSoon ? "expires soon" : "valid";
}

std::string day_text(std::time_t time) {
  return fmt::format("{:%Y-%m-%d}", fmt::gmtime(time));
}

int show(CliSession& session, const Said& said) {
  return with_folder(said, [&](const SecurityFolder& folder) {
    const auto identities = folder.identities();
    if (!identities) return CliSession::fail(identities.error());
    const std::time_t now = std::time(nullptr);
    std::vector<Row> rows;
    for (const IdentityView& one : *identities) {
      rows.push_back({{"name", one.subject.name},
                      {"role", to_string(one.subject.role)},
                      {"state", state_of(one, now)},
                      {"valid_from", day_text(one.validity.not_before)},
                      {"valid_until", day_text(one.validity.not_after)},
                      {"days_left", (one.validity.not_after - now) / kDay},
                      {"guid_prefix", fmt::format("{:02x}", fmt::join(one.prefix, ""))}});
    }
    static const std::vector<Column> columns{{"name", "NAME"},
                                             {"role", "ROLE"},
                                             {"state", "STATE"},
                                             {"valid_from", "VALID FROM"},
                                             {"valid_until", "VALID UNTIL"},
                                             {"days_left", "DAYS LEFT"},
                                             {"guid_prefix", "GUID PREFIX"}};
    if (const int shown = session.show(rows, columns); shown != kExitDone) return shown;
    for (const Row& row : rows) {
      if (row["state"] != "expires soon" && row["state"] != "expired") continue;
      fmt::print(stderr, "plcctl: '{0}' {1} {2}: 'plcctl security renew {0}'\n",
                 row["name"].get<std::string>(), row["state"] == "expired" ? "expired" : "expires",
                 row["valid_until"].get<std::string>());
    }
    return kExitDone;
  });
}

constexpr const char* kDirectory = "folder of the plant's identities (default /etc/plchost/security)";
constexpr const char* kDirectoryVariable = "PLCHOST_SECURITY";
constexpr const char* kDays = "for how many days from now";

}  // namespace

void add_security_verb(const Command& plcctl, CliSession& session) {
  const auto said = std::make_shared<Said>();
  const Command verb =
      plcctl.verb("security", "The rights of each client: identities, their roles and certificates");
  verb.noun("init", "Make the authorities of a plant and the identity of its first host",
            [said] { return init(said->new_directory, said->first_host); })
      .argument("DIR", said->new_directory, "a folder that is not there yet, or empty")
      .optional("HOST", said->first_host,
                "its name: [host] name of its configuration (default: this machine's)");
  const auto with_directory = [&](const Command& noun) -> const Command& {
    return noun.option("--directory", said->directory, kDirectory, kDirectoryVariable);
  };
  const auto most = std::int64_t{security::kDaysOfAuthority};
  with_directory(verb.noun("add-identity", "Make the key, certificate and permissions of a client or a host",
                           [said] { return add_identity(*said); }))
      .argument("ROLE", said->role, "viewer, operator, engineer, admin or host")
      .argument("NAME", said->name)
      .option("--days", said->days, kDays, std::int64_t{1}, most);
  with_directory(
      verb.noun("renew", "Make a fresh key and certificate for an identity", [said] { return renew(*said); }))
      .argument("NAME", said->name)
      .option("--days", said->days, kDays, std::int64_t{1}, most);
  with_directory(verb.noun("revoke", "Take an identity's rights away", [said] {
    return revoke(*said);
  })).argument("NAME", said->name);
  with_directory(verb.noun("show", "All identities, with their roles, and until when they are valid",
                           [&session, said] { return show(session, *said); }));
}

}  // namespace plchost
