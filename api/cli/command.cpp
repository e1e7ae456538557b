#include "api/cli/command.hpp"

#include <utility>

#include <CLI/CLI.hpp>

namespace plchost {

Command Command::verb(const char* name, const char* text) const {
  const auto known = app_->get_subcommands([name](CLI::App* other) { return other->get_name() == name; });
  CLI::App* const verb = known.empty() ? app_->add_subcommand(name, text) : known.front();
  verb->require_subcommand(1)->fallthrough();
  return {*verb, *chosen_};
}

Command Command::noun(const char* name, const char* text, Action action) const {
  CLI::App* const noun = app_->add_subcommand(name, text)->fallthrough();
  noun->callback([chosen = chosen_, action = std::move(action)] { *chosen = action; });
  return {*noun, *chosen_};
}

const Command& Command::argument(const char* form, std::string& value, const char* text) const {
  app_->add_option(form, value, text)->required();
  return *this;
}

const Command& Command::optional(const char* form, std::string& value, const char* text) const {
  app_->add_option(form, value, text);
  return *this;
}

const Command& Command::flag(const char* name, bool& value, const char* text) const {
  app_->add_flag(name, value, text);
  return *this;
}

template <class Number>
const Command& Command::option(const char* name, Number& value, const char* text, Number least,
                               Number most) const {
  app_->add_option(name, value, text)->check(CLI::Range(least, most));
  return *this;
}

template const Command& Command::option(const char*, double&, const char*, double, double) const;
template const Command& Command::option(const char*, std::int64_t&, const char*, std::int64_t,
                                        std::int64_t) const;
template const Command& Command::option(const char*, std::uint64_t&, const char*, std::uint64_t,
                                        std::uint64_t) const;

}  // namespace plchost
