#include "instances/adapters/strucpp/source_text.hpp"

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <map>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "instances/adapters/iec/place.hpp"
#include "instances/adapters/iec/pragmas.hpp"
#include "instances/adapters/iec/tokens.hpp"

namespace plchost::strucpp {

namespace {

using iec::folded;
using iec::Token;

void blank(std::string& text, std::size_t begin, std::size_t end) {
  for (char& c : std::span(text).subspan(begin, end - begin)) {
    if (c != '\n' && c != '\r') c = ' ';
  }
}

std::size_t end_of(const Token& token) {
  return token.offset + token.text.size();
}

/// Changes the text from token to token. An insertion comes last, as it moves what is behind it.
class Rewriter {
 public:
  Rewriter(const iec::Source& source, const std::set<std::string>& enumerations)
      : tokens_(iec::tokens_of(source.text, source.file).all), enumerations_(enumerations) {
    made_.text = source.text;
    for (const Token& token : tokens_) {
      if (iec::is_of_other_tools(token)) blank(made_.text, token.offset, end_of(token));
    }
    std::erase_if(tokens_, iec::is_of_other_tools);
  }

  SourceText run() {
    for (next_ = 0; !at_end(); ++next_) {
      const Token& token = tokens_[next_];
      if (token.kind == Token::Kind::literal) name_by_dot(token);
      if (token.is("PROGRAM")) in_program_ = true;
      if (token.is("END_PROGRAM")) in_program_ = false;
      if (token.is("CONFIGURATION")) read_configuration();
      if (in_program_ && is_section(token)) read_section();
    }
    hide_places();
    move_resource();
    return std::move(made_);
  }

 private:
  [[nodiscard]] const Token& token(std::size_t ahead = 0) const {
    return tokens_[std::min(next_ + ahead, tokens_.size() - 1)];
  }
  [[nodiscard]] bool at_end() const { return token().kind == Token::Kind::end; }
  [[nodiscard]] static bool is_section(const Token& token) {
    return token.is("VAR") || token.is("VAR_INPUT") || token.is("VAR_OUTPUT");
  }

  // Mode#busy is Mode.busy for the compiler.
  void name_by_dot(const Token& token) {
    const std::size_t sharp = token.text.find('#');
    if (sharp != std::string::npos && enumerations_.contains(folded(token.text.substr(0, sharp))))
      made_.text[token.offset + sharp] = '.';
  }

  // VAR RETAIN a, b AT %QX0.1 : BOOL; ... END_VAR
  void read_section() {
    ++next_;
    while (token().is("RETAIN") || token().is("NON_RETAIN") || token().is("CONSTANT")) ++next_;
    const Token* first = &token();  // of the declaration
    for (; !at_end() && !token().is("END_VAR"); ++next_) {
      if (token().kind == Token::Kind::literal) name_by_dot(token());
      if (token().is(";")) first = &token(1);
      if (token().is("AT") && token(1).kind == Token::Kind::place && iec::place_of(token(1).text))
        places_.push_back({first, &token(), &token(1)});
    }
  }

  // If two declarations in one line begin with one name, the compiler gets both as they are.
  void hide_places() {
    std::map<std::pair<unsigned, std::string>, int> counts;
    for (const Located& place : places_) ++counts[{place.first->place.line, folded(place.first->text)}];
    for (const auto& [first, at, location] : places_) {
      std::string name = folded(first->text);
      if (counts.at({first->place.line, name}) > 1) continue;
      blank(made_.text, at->offset, end_of(*location));
      made_.places.push_back(
          {.line = first->place.line, .name = std::move(name), .location = folded(location->text)});
    }
  }

  // Of a configuration with one RESOURCE: its head is put behind its globals, which are those of the
  // configuration then.
  void read_configuration() {
    std::size_t resources = 0;
    for (; !at_end() && !token().is("END_CONFIGURATION"); ++next_) {
      if (token().is("RESOURCE") && ++resources == 1) read_resource();
      if (token().kind == Token::Kind::literal) name_by_dot(token());
    }
    if (resources != 1) head_.reset();
  }
  // RESOURCE press ON PLC
  void read_resource() {
    if (!token(2).is("ON")) return;
    const Token* const first = &token();
    const Token* const last = &token(3);
    next_ += 3;
    const Token* behind = nullptr;
    while (token(1).is("VAR_GLOBAL")) {
      for (++next_; !at_end() && !token().is("END_VAR"); ++next_) {
        if (token().kind == Token::Kind::literal) name_by_dot(token());
      }
      behind = &token();
    }
    if (behind != nullptr && behind->is("END_VAR")) head_ = Head{first, last, behind};
  }
  void move_resource() {
    if (!head_) return;
    const Token& name = *(head_->first + 1);
    const std::string words = fmt::format(" RESOURCE {} ON {}", name.text, head_->last->text);
    blank(made_.text, head_->first->offset, end_of(*head_->last));
    made_.text.insert(end_of(*head_->behind), words);
    made_.inserted.push_back({.line = head_->behind->place.line,
                              .column = head_->behind->place.column + iec::characters_in(head_->behind->text),
                              .characters = iec::characters_in(words)});
  }

  struct Located {
    const Token* first;
    const Token* at;
    const Token* location;
  };
  struct Head {
    const Token* first;
    const Token* last;
    const Token* behind;  // the END_VAR of its globals
  };

  std::vector<Token> tokens_;
  const std::set<std::string>& enumerations_;
  std::size_t next_ = 0;
  bool in_program_ = false;
  std::vector<Located> places_;
  std::optional<Head> head_;
  SourceText made_;
};

}  // namespace

std::set<std::string> enumerations_in(std::span<const iec::Source> sources) {
  std::set<std::string> names;
  for (const iec::DeclaredType& type : iec::read_project(sources).project.types) {
    const std::string name = folded(type.name);
    if (type.definition.starts_with(name + " : (")) names.insert(name);
  }
  return names;
}

SourceText text_for_strucpp(const iec::Source& source, const std::set<std::string>& enumerations) {
  return Rewriter(source, enumerations).run();
}

}  // namespace plchost::strucpp
