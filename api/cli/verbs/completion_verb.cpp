#include <fmt/format.h>

#include "api/cli/cli_session.hpp"
#include "api/cli/words/completion.hpp"

namespace plchost {

void add_completion_verb(const Command& plcctl) {
  const Command verb = plcctl.verb("completion", "Print what a shell reads to complete this command line");
  const auto add = [&](const char* shell, const char* text) {
    verb.noun(shell, text, [shell] {
      fmt::print("{}", completion_script(shell));
      return kExitDone;
    });
  };
  add("bash", "In ~/.bashrc: source <(plcctl completion bash)");
  add("zsh", "In ~/.zshrc, behind compinit: source <(plcctl completion zsh)");
  add("fish", "In ~/.config/fish/config.fish: plcctl completion fish | source");
}

}  // namespace plchost
