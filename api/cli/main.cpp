#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <optional>
#include <ranges>
#include <span>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "api/cli/cli_session.hpp"
#include "api/cli/repeat.hpp"
#include "api/cli/terminal.hpp"
#include "api/cli/verbs/live_names.hpp"
#include "api/cli/verbs/security_verbs.hpp"
#include "api/cli/verbs/word_hint.hpp"
#include "api/cli/words/completion.hpp"
#include "api/cli/words/man_page.hpp"
#include "api/cli/words/number_range.hpp"
#include "api/cli/words/overview.hpp"
#include "api/cli/words/short_form.hpp"
#include "shm/base/names.hpp"
#include "shm/log/log.hpp"
#include "shm/pages/host_words.hpp"

namespace {

// An output that cannot be written is a failure, unless its reader has had enough. Another error of the
// system tells itself what it is about.
int carry_out(const plchost::Action& action) {
  int code = plchost::kExitFailed;
  try {
    code = action();
    errno = 0;
    if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return code;
  } catch (const std::system_error& error) {
    const bool of_output = std::ferror(stdout) != 0;  // thrown by fmt::print
    if (!of_output) return plchost::CliSession::fail({plchost::ErrorCode::system, 0, error.what()});
    errno = error.code().value();
  }
  if (errno == EPIPE) return code;
  return plchost::CliSession::fail({plchost::ErrorCode::system, errno, "cannot write the output"});
}

void add_options(CLI::App& app, plchost::CliOptions& options) {
  app.add_option("--host", options.hosts.host,
                 "which controller: a name, a pattern ('*', '?') or all; not needed when there is only one")
      ->envname("PLCHOST_HOST")
      ->take_last();
  app.add_option("--label", options.hosts.labels,
                 "controllers that have this label; may be repeated: all of them")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  app.add_option("--domain", options.dds.domain, "DDS domain (default 0)")
      ->envname("PLCHOST_DOMAIN")
      ->check(CLI::Range(0U, plchost::kMaxDdsDomain))
      ->take_last();
  constexpr double kMinTimeout = 0.1;
  constexpr double kMaxTimeout = 3600;
  app.add_option("--timeout", options.timeout_s,
                 "seconds to wait for an answer (default 3; commands that end a cycle or a process: 80)")
      ->check(plchost::number_range(kMinTimeout, kMaxTimeout))
      ->take_last();
  app.add_option_function<std::string>(
         "-o,--output",
         [&options](const std::string& form) {
           options.json = form == "json";
           options.csv = form == "csv";
           options.wide = form == "wide";
         },
         "table, wide (a table with all columns), json (an array of flat objects) or csv (default table)")
      ->check(CLI::IsMember({"table", "wide", "json", "csv"}))
      ->type_name("FORM");
  app.add_flag("--json", options.json, "the same as --output json");
  app.add_option_function<std::string>(
         "--columns",
         [&options](const std::string& fields) {
           options.columns.clear();
           for (const auto field : std::views::split(fields, ',')) {
             options.columns.emplace_back(field.begin(), field.end());
           }
         },
         "only these fields, by their names in JSON, separated by commas: name,state")
      ->type_name("FIELDS")
      ->take_last();
  app.add_option("--sort-by", options.sort_by, "sort by this field; -FIELD: the greatest first")
      ->type_name("FIELD")
      ->take_last();
  app.add_flag("-q,--quiet", options.quiet, "print errors only, and no confirmations");
  app.add_flag("-w,--watch", options.watch, "list and show: again and again, until Ctrl-C");
  app.add_option("--every", options.every_s, "seconds between two looks of --watch (default 2)")
      ->check(plchost::number_range(kMinTimeout, kMaxTimeout))
      ->take_last();
  app.add_option("--color", options.colour,
                 "states in colours: auto (on a terminal, unless NO_COLOR is set), always, never")
      ->check(CLI::IsMember({"auto", "always", "never"}))
      ->type_name("WHEN");
  app.add_option("--interface", options.dds.interfaces, "network interface (default lo); may be repeated")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  app.add_option("--peer", options.dds.peers,
                 "address of a controller (default on lo: 127.0.0.1); may be repeated")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  app.add_flag("--no-multicast{false}", options.dds.multicast,
               "look for controllers at --peer only, where an --interface has multicast");
  app.add_option("--identity", options.dds.identity,
                 "folder of the identity to show, where controllers are secured ('plcctl security')")
      ->envname("PLCHOST_IDENTITY")
      ->type_name("FOLDER")
      ->take_last();
}

std::vector<std::string> options_along(const plchost::Syntax& plcctl, std::span<const std::string> words) {
  std::vector<std::string> names;
  const auto add = [&](const plchost::Syntax& level) {
    for (const auto& option : level.options) {
      for (const std::string& name : option.names) {
        if (std::ranges::find(names, name) == names.end()) names.push_back(name);
      }
    }
  };
  const plchost::Syntax* level = &plcctl;
  add(*level);
  for (const std::string& word : words) {
    if (const plchost::Syntax* const next = level->word(word)) {
      level = next;
      add(*level);
    }
  }
  return names;
}

std::string hint_of(const plchost::Syntax& plcctl, std::span<const std::string> words) {
  if (std::string word = plchost::word_hint(plcctl, words); !word.empty()) return word;
  const std::string option = plchost::unknown_option(words, options_along(plcctl, words));
  return option.empty() ? "" : fmt::format("plcctl: {}\n", option);
}

/// Only then the error is about an option that is not known, or about one that stands where a word is
/// missing. Else the value of an option is wrong, which may look like an option: "--count -3".
bool is_about_words(const CLI::ParseError& error) {
  const int code = error.get_exit_code();
  return code == static_cast<int>(CLI::ExitCodes::ExtrasError) ||
         code == static_cast<int>(CLI::ExitCodes::RequiredError);
}

/// 'plcctl', 'plcctl help', 'plcctl help list' and 'plcctl list' list what there is. The exit code; nothing:
/// a command is there.
std::optional<int> overview_wanted(const plchost::Syntax& plcctl, std::span<const std::string> words) {
  const std::vector<std::string> plain = plchost::without_options(plcctl, words);
  const bool asked = !plain.empty() && plain.front() == "help";
  if (asked) words = std::span(plain).subspan(1);
  const plchost::Syntax* level = &plcctl;
  std::string said = "plcctl";
  for (const std::string& word : words) {
    level = level->word(word);
    if (level == nullptr) return std::nullopt;
    said += " " + word;
  }
  if (level->words.empty()) return std::nullopt;
  fmt::print("{}", plchost::overview(*level, said));
  return asked ? plchost::kExitDone : plchost::kExitUsage;
}

constexpr const char* kExitCodes =
    "Exit codes: 0 done, 1 refused, failed or a problem found, 2 usage, 3 no answer, 4 warnings found.";

bool parses(CLI::App& app, const std::vector<std::string>& words) {
  try {
    app.parse(std::vector<std::string>(words.rbegin(), words.rend()));
    return true;
  } catch (const CLI::ParseError&) {
    return false;
  }
}

// Called by the shells' scripts: a candidate in each line, a tabulator, its meaning.
int offer(CLI::App& app, plchost::CliSession& session, std::span<const std::string> words) {
  const plchost::Completion completion = plchost::complete(plchost::syntax_of(app), words);
  constexpr double kPatienceOnTab = 1;
  session.options.timeout_s = kPatienceOnTab;
  // There is no verb yet; the options in front of it are read all the same.
  (void)parses(app, completion.options);
  if (completion.value == "FILE") fmt::print(":files\n");
  auto candidates = completion.candidates;
  for (plchost::Candidate& name : plchost::live_names(session, completion.value)) {
    if (name.word.starts_with(words.back())) candidates.push_back(std::move(name));
  }
  for (const auto& [word, text] : candidates)
    fmt::print("{}\t{}\n", plchost::printable(word), plchost::printable(text));
  return plchost::kExitDone;
}

}  // namespace

int main(int argc, char** argv) {
  plchost::CliSession session;
  plchost::Action action;
  CLI::App app("plcctl: control of plchost over DDS", "plcctl");
  app.set_version_flag("--version", PLCHOST_VERSION);
  app.require_subcommand(1);
  app.footer(kExitCodes);
  add_options(app, session.options);
  const plchost::Command plcctl(app, action);
  plchost::add_list_verbs(plcctl, session);
  plchost::add_show_verbs(plcctl, session);
  plchost::add_command_verbs(plcctl, session);
  plchost::add_check_verb(plcctl, session);
  plchost::add_post_verb(plcctl, session);
  plchost::add_logs_verb(plcctl, session);
  plchost::add_variable_verbs(plcctl, session);
  plchost::add_wait_verb(plcctl, session);
  plchost::add_watch_verb(plcctl, session);
  plchost::add_top_verb(plcctl, session);
  plchost::add_security_verb(plcctl, session);
  plchost::add_plant_verbs(plcctl, session);
  plchost::add_verify_verb(plcctl, session);
  plchost::add_debug_verb(plcctl, session);
  plchost::add_build_verb(plcctl, session);
  plchost::add_export_verb(plcctl, session, PLCHOST_VERSION);
  plchost::add_save_verb(plcctl, session, PLCHOST_VERSION);
  plchost::add_completion_verb(plcctl);
  const std::vector<std::string> words(argv + 1, argv + argc);
  plchost::start_log("plcctl", "warning");
  // For programs: the completion of the command line, and the manual page.
  if (words.size() > 1 && words.front() == "__complete")
    return offer(app, session, std::span(words).subspan(1));
  if (words.size() == 1 && words.front() == "__man") {
    fmt::print("{}", plchost::man_page(plchost::syntax_of(app), kExitCodes));
    return plchost::kExitDone;
  }
  if (const auto code = overview_wanted(plchost::syntax_of(app), words)) return *code;
  const std::vector<std::string> whole = plchost::with_noun(plchost::syntax_of(app), words);
  try {
    app.parse(std::vector<std::string>(whole.rbegin(), whole.rend()));
  } catch (const CLI::ParseError& error) {
    if (is_about_words(error)) {
      if (const std::string text = hint_of(plchost::syntax_of(app), whole); !text.empty()) {
        fmt::print(stderr, "{}", text);
        return plchost::kExitUsage;
      }
    }
    return app.exit(error) == 0 ? plchost::kExitDone : plchost::kExitUsage;
  }
  session.options.timeout_given = app.count("--timeout") > 0;
  const std::string& colour = session.options.colour;
  session.options.coloured = colour == "always" || (colour == "auto" && plchost::shows_colours());
  if (!session.options.watch) return carry_out(action);
  if (!app.got_subcommand("list") && !app.got_subcommand("show")) {
    fmt::print(stderr, "plcctl: --watch goes with list and show\n");
    return plchost::kExitUsage;
  }
  return carry_out([&] { return plchost::repeat({.every_s = session.options.every_s}, action); });
}
