#include "api/cli/words/man_page.hpp"

#include <algorithm>
#include <cctype>

#include <fmt/format.h>

namespace plchost {

namespace {

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '\\') {
      out += "\\e";
    } else if (c == '-') {
      out += "\\-";
    } else {
      out += c;
    }
  }
  // A line that begins so would be a request.
  return out.starts_with('.') || out.starts_with('\'') ? "\\&" + out : out;
}

std::string upper(std::string text) {
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return std::toupper(c); });
  return text;
}

std::string option_lines(const Syntax& of) {
  std::string text;
  for (const auto& option : of.options) {
    const std::string value = option.value.empty() ? "" : " \\fI" + escaped(option.value) + "\\fR";
    text += fmt::format(".TP\n\\fB{}\\fR{}\n{}\n", escaped(fmt::format("{}", fmt::join(option.names, ", "))),
                        value, escaped(option.text));
  }
  return text;
}

std::string synopsis(const std::string& path, const Syntax& of) {
  std::string text = fmt::format(".B {}\n", escaped(path));
  for (const auto& argument : of.arguments) {
    text += argument.required ? fmt::format(".I {}\n", escaped(argument.form))
                              : fmt::format(".RI [ {} ]\n", escaped(argument.form));
  }
  if (of.option("--help") != nullptr && of.options.size() > 1) text += ".RI [ options ]\n";
  return text;
}

void add_commands(const std::string& path, const Syntax& of, std::string& page) {
  for (const Syntax& word : of.words) {
    const std::string here = path + " " + word.name;
    if (!word.words.empty()) {
      add_commands(here, word, page);
      continue;
    }
    page += ".SS " + escaped(here.substr(here.find(' ') + 1)) + "\n" + synopsis(here, word) + ".PP\n" +
            escaped(word.text) + "\n";
    for (const auto& argument : word.arguments) {
      if (argument.text.empty()) continue;
      page += fmt::format(".TP\n.I {}\n{}\n", escaped(argument.form), escaped(argument.text));
    }
    Syntax without_help = word;
    std::erase_if(without_help.options, [](const auto& option) { return option.names.back() == "--help"; });
    page += option_lines(without_help);
  }
}

}  // namespace

std::string man_page(const Syntax& program, const std::string& exit_codes) {
  const std::string what = program.text.substr(program.text.find(": ") + 2);
  std::string page = fmt::format(".TH {} 1 \"\" plchost\n.SH NAME\n{} \\- {}\n", upper(program.name),
                                 escaped(program.name), escaped(what));
  page += fmt::format(".SH SYNOPSIS\n.B {}\n.RI [ options ] \" VERB NOUN \" [ arguments ]\n",
                      escaped(program.name));
  page += ".SH OPTIONS\n" + option_lines(program);
  page += ".SH COMMANDS\n";
  add_commands(program.name, program, page);
  page += ".SH EXIT STATUS\n" + escaped(exit_codes) + "\n.SH ENVIRONMENT\n";
  for (const auto& option : program.options) {
    if (option.variable.empty()) continue;
    page += fmt::format(".TP\n.B {}\nvalue of {} if that option is not given\n", escaped(option.variable),
                        escaped(option.names.back()));
  }
  return page;
}

}  // namespace plchost
