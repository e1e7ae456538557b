#include "api/cli/words/command.hpp"

#include <utility>

#include <CLI/CLI.hpp>

#include "api/cli/words/number_range.hpp"

namespace plchost {

namespace {

void add_option(const CLI::Option& option, Syntax& to) {
  if (option.get_positional()) {
    to.arguments.push_back({option.get_name(true), option.get_description(), option.get_required()});
    return;
  }
  std::vector<std::string> names;
  for (const std::string& name : option.get_snames()) names.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) names.push_back("--" + name);
  // "FLOAT:FLOAT in [0.1 - 3600]" names the type twice.
  std::string value = option.get_items_expected_max() == 0 ? "" : option.get_type_name();
  if (const auto colon = value.find(':'); colon != std::string::npos) value.erase(0, colon + 1);
  to.options.push_back({std::move(names), value, option.get_description(), option.get_envname()});
}

}  // namespace

Syntax syntax_of(const CLI::App& app) {
  Syntax syntax{
      .name = app.get_name(), .text = app.get_description(), .options = {}, .arguments = {}, .words = {}};
  for (const CLI::Option* option : app.get_options()) add_option(*option, syntax);
  for (const CLI::App* word : app.get_subcommands([](const CLI::App*) { return true; })) {
    syntax.words.push_back(syntax_of(*word));
  }
  return syntax;
}

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

const Command& Command::arguments(const char* form, std::vector<std::string>& values,
                                  const char* text) const {
  app_->add_option(form, values, text)->required();
  return *this;
}

const Command& Command::choice(const char* name, std::string& value, const char* text,
                               const std::vector<std::string>& words) const {
  app_->add_flag(name, value, text)->check(CLI::IsMember(words));
  return *this;
}

const Command& Command::word(const char* name, std::string& value, const char* text,
                             const std::vector<std::string>& words) const {
  app_->add_option(name, value, text)->check(CLI::IsMember(words))->type_name("WORD");
  return *this;
}

const Command& Command::optional(const char* form, std::string& value, const char* text) const {
  app_->add_option(form, value, text);
  return *this;
}

const Command& Command::optional(const char* form, std::vector<std::string>& values, const char* text) const {
  app_->add_option(form, values, text);
  return *this;
}

const Command& Command::flag(const char* name, bool& value, const char* text) const {
  app_->add_flag(name, value, text);
  return *this;
}

const Command& Command::file(const char* name, std::string& value, const char* text) const {
  app_->add_option(name, value, text)->required()->type_name("FILE");
  return *this;
}

const Command& Command::option(const char* name, std::optional<std::string>& value, const char* text) const {
  app_->add_option_function<std::string>(
          name, [&value](const std::string& given) { value = given; }, text)
      ->take_last();
  return *this;
}

const Command& Command::option(const char* name, std::string& value, const char* text,
                               const char* variable) const {
  app_->add_option(name, value, text)->envname(variable)->take_last();
  return *this;
}

template <class Number>
const Command& Command::option(const char* name, Number& value, const char* text, Number least,
                               Number most) const {
  app_->add_option(name, value, text)->check(number_range(least, most));
  return *this;
}

template const Command& Command::option(const char*, double&, const char*, double, double) const;
template const Command& Command::option(const char*, std::int64_t&, const char*, std::int64_t,
                                        std::int64_t) const;
template const Command& Command::option(const char*, std::uint64_t&, const char*, std::uint64_t,
                                        std::uint64_t) const;

}  // namespace plchost
