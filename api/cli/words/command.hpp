#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "api/cli/words/syntax.hpp"

namespace CLI {
class App;
}

namespace plchost {

/// The most that an option counts to: a larger number is a slip of the hand.
inline constexpr std::uint64_t kMaxCount = 1'000'000'000'000;

/// All that can be said on the command line.
[[nodiscard]] Syntax syntax_of(const CLI::App& app);

/// The work of plcctl when all options are read; gives its exit code.
using Action = std::function<int()>;

/// A word of plcctl's command line and what may stand behind it. Set-up, until the command line is read.
/// The variables of options and arguments must exist until then: capture them by value, shared, in the
/// action. (CLI11 is behind this, so that its headers are not compiled again for each verb.)
class Command {
 public:
  /// The program itself. `chosen` receives the action of the noun that was chosen; both must outlive this.
  Command(CLI::App& app, Action& chosen) noexcept : app_(&app), chosen_(&chosen) {}

  /// A verb, which wants a noun after it; made where it is named first, so that several files can add nouns.
  [[nodiscard]] Command verb(const char* name, const char* text) const;
  /// A noun below a verb, and what is done when it was chosen.
  Command noun(const char* name, const char* text, Action action) const;  // NOLINT(modernize-use-nodiscard)

  /// An argument that must follow; `form` is how the help shows it.
  const Command& argument(const char* form, std::string& value, const char* text = "") const;
  /// One or more of what must follow.
  const Command& arguments(const char* form, std::vector<std::string>& values, const char* text = "") const;
  /// An argument that may follow.
  const Command& optional(const char* form, std::string& value, const char* text) const;
  /// Any number of what may follow.
  const Command& optional(const char* form, std::vector<std::string>& values, const char* text) const;
  const Command& flag(const char* name, bool& value, const char* text) const;
  /// A file that must be named, "-f,--file".
  const Command& file(const char* name, std::string& value, const char* text) const;
  /// A text, which a variable of the environment can stand for.
  const Command& option(const char* name, std::string& value, const char* text, const char* variable) const;
  /// Without the option: nothing. An empty text is a value.
  const Command& option(const char* name, std::optional<std::string>& value, const char* text) const;
  /// One of several words, "--name=WORD". `name`: "--name{WORD}", where WORD is what "--name" alone stands
  /// for.
  const Command& choice(const char* name, std::string& value, const char* text,
                        const std::vector<std::string>& words) const;
  /// An option whose value is one of several words.
  const Command& word(const char* name, std::string& value, const char* text,
                      const std::vector<std::string>& words) const;
  /// A number from `least` to `most`; anything else is an error that names both.
  template <class Number>
  const Command& option(const char* name, Number& value, const char* text, Number least, Number most) const;

 private:
  CLI::App* app_;
  Action* chosen_;
};

extern template const Command& Command::option(const char*, double&, const char*, double, double) const;
extern template const Command& Command::option(const char*, std::int64_t&, const char*, std::int64_t,
                                               std::int64_t) const;
extern template const Command& Command::option(const char*, std::uint64_t&, const char*, std::uint64_t,
                                               std::uint64_t) const;

}  // namespace plchost
