#include <cmath>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "api/cli/cli_session.hpp"
#include "shm/base/log.hpp"

namespace {

void add_options(CLI::App& app, plchost::CliOptions& options) {
  app.add_option("--host", options.host, "which controller; not needed when there is only one")
      ->envname("PLCHOST_HOST")
      ->take_last();
  app.add_option("--domain", options.dds.domain, "DDS domain (default 0)")
      ->envname("PLCHOST_DOMAIN")
      ->check(CLI::Range(0U, plchost::dds::kMaxDomain))
      ->take_last();
  constexpr double kMinTimeout = 0.1;
  constexpr double kMaxTimeout = 3600;
  app.add_option("--timeout", options.timeout_s,
                 "seconds to wait for an answer (default 3; what ends a cycle or a process: 80)")
      ->check(CLI::Range(kMinTimeout, kMaxTimeout))
      ->take_last();
  app.add_flag("--json", options.json, "an array of flat objects, for programs");
  app.add_option("--interface", options.dds.interfaces, "network interface (default lo); may be repeated")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  app.add_option("--peer", options.dds.peers, "address of a controller (default 127.0.0.1); may be repeated")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
}

// What follows a wrong word is not the mistake: only the first word that no command knows is looked at.
std::string word_hint(const CLI::App& app, int argc, char** argv) {
  const CLI::App* level = &app;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word.starts_with('-')) return "";
    std::vector<std::string> known;
    const CLI::App* next = nullptr;
    for (const CLI::App* sub : level->get_subcommands([](const CLI::App*) { return true; })) {
      known.push_back(sub->get_name());
      if (sub->get_name() == word) next = sub;
    }
    if (known.empty()) return "";
    if (next == nullptr) {
      return fmt::format("plcctl: unknown word '{}'{}; known here: {}\n", word, plchost::hint(word, known),
                         fmt::join(known, ", "));
    }
    level = next;
  }
  return "";
}

}  // namespace

int main(int argc, char** argv) {
  plchost::CliSession session;
  plchost::Action action;
  CLI::App app("plcctl: control of plchost over DDS", "plcctl");
  app.require_subcommand(1);
  app.footer(
      "Exit codes: 0 done, 1 refused, failed or a problem found, 2 usage, 3 no answer, 4 warnings found.");
  add_options(app, session.options);
  const plchost::Command plcctl(app, action);
  plchost::add_list_verbs(plcctl, session);
  plchost::add_show_verbs(plcctl, session);
  plchost::add_command_verbs(plcctl, session);
  plchost::add_check_verb(plcctl, session);
  plchost::add_post_verb(plcctl, session);
  plchost::add_watch_verb(plcctl, session);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() != 0) {
      if (const std::string text = word_hint(app, argc, argv); !text.empty()) {
        fmt::print(stderr, "{}", text);
        return plchost::kExitUsage;
      }
    }
    return app.exit(error) == 0 ? plchost::kExitDone : plchost::kExitUsage;
  }
  session.options.timeout_given = app.count("--timeout") > 0;
  plchost::start_log("plcctl", "warning");
  return action();
}
