#include "api/cli/words/completion.hpp"

#include <map>

namespace plchost {

namespace {

/// Goes along the words that are there.
class Walk {
 public:
  explicit Walk(const Syntax& plcctl) : levels_{&plcctl} {}

  void pass(const std::string& word) {
    if (waiting_ != nullptr) {
      keep(word);
      waiting_ = nullptr;
    } else if (word.starts_with('-')) {
      begin_option(word);
    } else if (const Syntax* next = here().word(word)) {
      levels_.push_back(next);
    } else {
      ++arguments_;
    }
  }

  [[nodiscard]] Completion offer(const std::string& unfinished) const {
    Completion completion;
    completion.options = own_options_;
    if (waiting_ != nullptr) {
      completion.value = waiting_->names.back();
      if (own_) completion.options.pop_back();  // it has no value yet
    } else if (unfinished.starts_with('-')) {
      for (const Syntax* level : levels_) {
        for (const auto& option : level->options)
          completion.candidates.push_back({option.names.back(), option.text});
      }
    } else if (!here().words.empty()) {
      for (const Syntax& word : here().words) completion.candidates.push_back({word.name, word.text});
    } else if (arguments_ < here().arguments.size()) {
      completion.value = here().arguments[arguments_].form;
    }
    std::erase_if(completion.candidates,
                  [&](const Candidate& one) { return !one.word.starts_with(unfinished); });
    return completion;
  }

 private:
  [[nodiscard]] const Syntax& here() const { return *levels_.back(); }

  void begin_option(const std::string& word) {
    const std::string name = word.substr(0, word.find('='));
    for (const Syntax* level : levels_) {
      const Syntax::Option* const option = level->option(name);
      if (option == nullptr) continue;
      own_ = level == levels_.front();
      if (option->value.empty()) return;
      if (name != word) return keep(word);
      waiting_ = option;
      if (own_) own_options_.push_back(word);
      return;
    }
  }

  void keep(const std::string& word) {
    if (own_) own_options_.push_back(word);
  }

  std::vector<const Syntax*> levels_;
  std::size_t arguments_ = 0;
  const Syntax::Option* waiting_ = nullptr;  // for its value
  bool own_ = false;                         // the option that was seen last is one of plcctl itself
  std::vector<std::string> own_options_;
};

constexpr std::string_view kBash =
    R"(# plcctl: completion for bash; in ~/.bashrc: source <(plcctl completion bash)
_plcctl() {
  local line
  COMPREPLY=()
  while IFS= read -r line; do
    if [[ $line == :files ]]; then
      compopt -o filenames 2>/dev/null
      mapfile -t COMPREPLY < <(compgen -f -- "${COMP_WORDS[COMP_CWORD]}")
    else
      # Names may hold what a shell would run.
      printf -v line %q "${line%%$'\t'*}"
      COMPREPLY+=("$line")
    fi
  done < <(plcctl __complete "${COMP_WORDS[@]:1:COMP_CWORD}" 2>/dev/null)
}
complete -F _plcctl plcctl
)";

constexpr std::string_view kZsh = R"(#compdef plcctl
# plcctl: completion for zsh; in ~/.zshrc, behind compinit: source <(plcctl completion zsh)
_plcctl() {
  local line word
  local -a found
  while IFS= read -r line; do
    if [[ $line == :files ]]; then
      _files
      return
    fi
    word=${line%%$'\t'*}
    found+=("${word//:/\\:}:${line#*$'\t'}")
  done < <(plcctl __complete "${(@)words[2,CURRENT]}" 2>/dev/null)
  _describe plcctl found
}
compdef _plcctl plcctl
# As a file of $fpath, this is the body of the function _plcctl, and its first call.
[[ $funcstack[1] != _plcctl ]] || _plcctl
)";

constexpr std::string_view kFish =
    R"(# plcctl: completion for fish; in ~/.config/fish/config.fish: plcctl completion fish | source
function __plcctl_complete
  set -l words (commandline -opc)[2..-1] (commandline -ct)
  for line in (plcctl __complete $words 2>/dev/null)
    if test "$line" = :files
      __fish_complete_path (commandline -ct)
    else
      echo $line
    end
  end
end
complete -c plcctl -f -a '(__plcctl_complete)'
)";

}  // namespace

Completion complete(const Syntax& plcctl, std::span<const std::string> words) {
  Walk walk(plcctl);
  if (words.empty()) return walk.offer("");
  for (const std::string& word : words.first(words.size() - 1)) walk.pass(word);
  return walk.offer(words.back());
}

std::string_view completion_script(std::string_view shell) {
  static const std::map<std::string_view, std::string_view> scripts{
      {"bash", kBash}, {"zsh", kZsh}, {"fish", kFish}};
  const auto found = scripts.find(shell);
  return found != scripts.end() ? found->second : std::string_view();
}

}  // namespace plchost
